// Scalar operations of the instruction set, one lane: 32 bits in, 32 bits out.
#ifndef ROPSIM_EXECUTE_MATH_H
#define ROPSIM_EXECUTE_MATH_H

#include "isa.h"

uint32_t execute_fpow(uint32_t a, uint32_t b);
uint32_t execute_ftou(uint32_t a);
uint32_t execute_utof(uint32_t a);
uint32_t execute_ztof(format format, uint32_t code, bool reversed);

#endif

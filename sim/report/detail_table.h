// The table of passes below the summary of detail_print.
#ifndef ROPSIM_DETAIL_TABLE_H
#define ROPSIM_DETAIL_TABLE_H

#include "../levels.h"

void detail_print_passes(const detail_result *detail, FILE *out);

#endif

// The reader of machine files; machine.c alone calls it.
#ifndef ROPSIM_MACHINE_YAML_H
#define ROPSIM_MACHINE_YAML_H

#include "sim.h"

// Reads every key of `machine` but its name from a YAML file. Each error is said as file:line:column.
status machine_read_yaml(const char *path, const report *report, machine *machine);

#endif

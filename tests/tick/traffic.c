#include "tick.h"
#include <stdlib.h>
struct traffic { statistics s; plane_traffic planes[PLANE_MAX]; };
traffic *traffic_create(const machine *machine, const frame *frame) { (void)machine; (void)frame; return calloc(1, sizeof(traffic)); }
void traffic_destroy(traffic *traffic) { free(traffic); }
void traffic_begin_pass(traffic *traffic, const pass_info *pass) { (void)traffic; (void)pass; }
void traffic_stamp(traffic *traffic, const stamp *stamp) { (void)traffic; (void)stamp; }
void traffic_end_pass(traffic *traffic) { (void)traffic; }
void traffic_end_run(traffic *traffic) { (void)traffic; }
const statistics *traffic_counts(const traffic *traffic) { return &traffic->s; }
const plane_traffic *traffic_planes(const traffic *traffic) { return traffic->planes; }

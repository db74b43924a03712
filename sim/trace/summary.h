// Figures of a whole trace: how deep its samples are and how near to front-to-back order they arrive.
#ifndef ROPSIM_TRACE_SUMMARY_H
#define ROPSIM_TRACE_SUMMARY_H

#include "../sim.h"

enum { SUMMARY_BINS = 1025 };  // the last one: 1024 and more

typedef struct trace_summary {
    double depth_min, depth_max;        // of the finite depths of all fragments; 0 and 0 if there are none
    uint64_t depth_outside;             // finite depths below 0 or above 1: the ROP clamps them
    uint64_t nonfinite;                 // fragments with an infinity or a NaN
    // Of the transparent and sorted fragments, by sample:
    uint64_t samples, covered_samples;  // of the picture; with at least one such fragment
    uint64_t fragments;
    uint64_t deepest;                   // most fragments at one sample
    uint64_t histogram[SUMMARY_BINS];   // [k]: samples with k fragments
    uint64_t pairs;                     // neighbours in arrival order at one sample: fragments - covered_samples
    uint64_t pairs_in_order, pairs_tied;  // the second is not nearer than the first; has the same depth
    uint64_t runs, runs_most;           // stretches in front-to-back order: in total, most at one sample
} trace_summary;

// Reads the trace from its start, in bands of rows so that it needs at most 512 MiB; leaves it rewound, whole.
status trace_summarize(trace *trace, const report *report, trace_summary *summary);

#endif

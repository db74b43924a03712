// A program, a machine and an image in; whether every way of replaying them equals the twin out.
#include "random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

typedef struct way {
    int threads, vector_bytes;
    uint64_t memory_bytes;
    bool every_batch;
} way;

static const way ways[] = {
    {1, 16, 0, false}, {1, 32, 0, false}, {1, 64, 0, false}, {2, 0, 0, false}, {1, 0, 1, false}, {3, 0, 20000, false}, {1, 0, 0, true},
};

static void describe(const program *program, const machine *machine, const twin_image *image, const char *label)
{
    print_message("%s: %u x %u, %u samples, %u draws, %u fragments%s%s on\n", label, image->width, image->height,
                  image->samples, image->draw_count, image->fragment_count,
                  image->reversed_depth ? ", reversed depth" : "", image->nonfinite ? ", nonfinite" : "");
    machine_print(machine, stdout);
    disassemble_text(program, stdout);
}

static void say(void *user, severity severity, const char *text)
{
    (void)user;
    (void)severity;
    print_message("%s\n", text);
}

const report printing = {.say = say};

bool runs_on(const program *program, const machine *machine)
{
    rop_limits limits;
    machine_limits(machine, &limits);
    return verify_program(program, "test", &limits, NULL) == STATUS_OK;
}

bool same_as_twin(const program *program, const machine *machine, const twin_image *image, uint64_t max_iterations,
                  double occlusion_ratio, const char *label)
{
    rop_limits limits;
    machine_limits(machine, &limits);
    twin_result twin;
    twin_run(program, &limits, image, max_iterations, occlusion_ratio, &twin);
    trace *trace = random_image_open(image);
    bool same = true;
    for (size_t i = 0; same && i < sizeof ways / sizeof *ways; i++) {
        if (!execute_select(ways[i].vector_bytes))
            continue;
        const run_options options = {
            .threads = ways[i].threads,
            .vector_bytes = ways[i].vector_bytes,
            .memory_bytes = ways[i].memory_bytes,
            .max_iterations = max_iterations,
            .occlusion_ratio = occlusion_ratio,
            .keep_planes = true,
            .every_batch = ways[i].every_batch,
            .reference = !image->nonfinite,  // what infinities add up to depends on the order
        };
        char difference[256] = "it failed";
        run_result *run;
        same = replay_run(program, machine, trace, &options, &printing, &run) == STATUS_OK &&
               run->fragments_in_trace == image->fragment_count && twin_compare(program, &twin, run, difference);
        if (!same) {
            print_message(
                "threads %d, vectors of %d bytes, memory %llu, %s, at most %llu iterations, occlusion ratio %g: %s\n",
                options.threads, options.vector_bytes, (unsigned long long)options.memory_bytes,
                options.every_batch ? "every batch" : "foregone batches counted",
                (unsigned long long)max_iterations, occlusion_ratio, difference);
            describe(program, machine, image, label);
        }
        result_destroy(run);
    }
    trace_close(trace);
    twin_free(&twin);
    return same;
}

uint64_t test_seed(void)
{
    const char *text = getenv("ROPSIM_TEST_SEED");
    return text ? strtoull(text, NULL, 0) : 1;
}

uint32_t test_count(uint32_t usual)
{
    const char *text = getenv("ROPSIM_TEST_COUNT");
    return text ? (uint32_t)strtoul(text, NULL, 0) : usual;
}

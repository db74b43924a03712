// Lines that stamps touched while nobody looked: caches end up with those used last, in whatever order they hear of them; what was
// changed unseen is written back when the pass ends.
#include "cost_fixture.h"

#include "../../sim/mem/memory.h"

static const report quiet = {0};

enum { SIDE = 128, BLOCKS = SIDE / 8 * SIDE / 8, TOUCHES = 3000, RUNS = 40 };

typedef struct bed {
    machine machine;
    program *program;
    trace *trace;
    run_result *function;
    arrival *arrival;  // whose frame the memory sees
    box box;
    box_scene scene;
} bed;

static void make(bed *b, const char *sets)
{
    static const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true};
    char file[4096];
    *b = (bed){.machine = cost_machine("tiny", sets), .box = {0, 0, SIDE, SIDE, 0.5, CLASS_TRANSPARENT}};
    b->scene = (box_scene){.width = SIDE, .height = SIDE, .samples = 1, .boxes = &b->box, .count = 1};
    b->trace = cost_trace(&b->scene);
    assert_int_equal(program_load("weighted_sum", &quiet, file, sizeof file, &b->program), STATUS_OK);
    assert_int_equal(replay_run(b->program, &b->machine, b->trace, &options, &quiet, &b->function), STATUS_OK);
    assert_int_equal(arrival_create(b->program, &b->machine, b->trace, b->function, &(arrival_options){0}, &quiet, &b->arrival), STATUS_OK);
}

static void drop(bed *b)
{
    arrival_destroy(b->arrival);
    result_destroy(b->function);
    program_destroy(b->program);
    trace_close(b->trace);
}

static memory *begin(const bed *b)
{
    static statistics ignored;
    memory *m;
    assert_int_equal(memory_create(&b->machine, arrival_frame(b->arrival), &quiet, &m), STATUS_OK);
    memory_begin_pass(m, &(pass_info){.kind = PASS_DRAW}, &ignored);
    return m;
}

static uint32_t random_below(uint32_t below)
{
    static uint64_t state = 1;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 33) % below;
}

// What a cache of depth holds, a line each, and whether it was changed: its ids in order.
static int by_id(const void *a, const void *b)
{
    const uint64_t x = ((const cache_line *)a)->id, y = ((const cache_line *)b)->id;
    return (x > y) - (x < y);
}

static void assert_same_lines(memory *a, memory *b)
{
    for (int64_t p = 0; p < a->machine->partitions; p++) {
        const cache *ca = &a->caches[p][ACCESS_DEPTH], *cb = &b->caches[p][ACCESS_DEPTH];
        for (uint32_t set = 0; set < ca->sets; set++) {
            cache_line *la = ca->lines + (size_t)set * ca->ways, *lb = cb->lines + (size_t)set * cb->ways;
            qsort(la, ca->ways, sizeof *la, by_id);
            qsort(lb, cb->ways, sizeof *lb, by_id);
            for (uint32_t way = 0; way < ca->ways; way++) {
                assert_int_equal(la[way].id, lb[way].id);
                assert_int_equal(la[way].dirty, lb[way].dirty);
                assert_int_equal(la[way].valid, lb[way].valid);
            }
        }
    }
}

typedef struct touch { uint32_t tile; bool write; uint64_t time; } touch;

static void tell(memory *m, touch *touches, uint32_t count, bool look)
{
    statistics ignored = {0};
    for (uint32_t i = 0; i < count; i++) {
        const plane_access access = {0, ACCESS_DEPTH, UINT64_MAX, touches[i].write ? UINT64_MAX : 0};
        const stamp stamp = {.tile = touches[i].tile, .lanes = UINT64_MAX, .accesses = &access, .access_count = 1, .time = touches[i].time};
        if (look) {
            memory_at(m, stamp.tile, stamp.time);
            memory_stamp(m, &stamp, &ignored);
        } else {
            memory_warm(m, &stamp, &stamp.time);
        }
    }
}

static void shuffle(touch *touches, uint32_t count)
{
    for (uint32_t i = count; i > 1; i--) {
        const uint32_t k = random_below(i);
        const touch kept = touches[i - 1];
        touches[i - 1] = touches[k];
        touches[k] = kept;
    }
}

// Stamps in order and looked at, against the same ones in any order and only heard of. Each line is written each time it comes or never, as a line
// that comes back clean and one that stayed changed are told apart by nothing but time.
static void any_order_gives_the_same_lines(void **state)
{
    static touch touches[TOUCHES];
    bed b;
    (void)state;
    make(&b, "depth_cache_bytes=2048 depth_cache_ways=4");
    for (int run = 0; run < RUNS; run++) {
        const uint32_t blocks = 1 + random_below(BLOCKS);
        for (uint32_t i = 0; i < TOUCHES; i++) {
            const uint32_t tile = random_below(blocks);
            touches[i] = (touch){tile, tile % 3 == 0, i + 1};
        }
        memory *in_order = begin(&b), *unseen = begin(&b);
        tell(in_order, touches, TOUCHES, true);
        shuffle(touches, TOUCHES);
        tell(unseen, touches, TOUCHES, false);
        assert_same_lines(in_order, unseen);
        memory_destroy(in_order);
        memory_destroy(unseen);
    }
    drop(&b);
}

static uint64_t flush(memory *m, uint64_t *bytes)
{
    statistics s = {0};
    uint32_t partition;
    access_unit cache;
    transfer spill;
    while (memory_flush(m, false, &partition, &cache, &spill, &s))
        continue;
    *bytes = s.rop_bytes_written;
    return s.depth_writebacks;
}

static void changed_unseen_is_written_at_the_end(void **state)
{
    bed b;
    uint64_t bytes;
    (void)state;
    make(&b, "depth_cache_bytes=1048576 depth_compression=false");
    memory *m = begin(&b);
    for (uint32_t tile = 0; tile < BLOCKS; tile += 2)
        memory_pass_over(m, tile, 1, UINT64_MAX, 1 + random_below(1000));
    const uint64_t lines = m->planes[0].parts;
    assert_int_equal(flush(m, &bytes), BLOCKS / 2 * lines);
    assert_int_equal(bytes, BLOCKS / 2 * lines * m->planes[0].part_bytes);
    assert_int_equal(flush(m, &bytes), 0);
    memory_destroy(m);
    drop(&b);
}

// What the pass has used keeps its place, and what was changed unseen is then taken to have been written back.
static void changed_unseen_takes_no_place_of_what_is_used(void **state)
{
    bed b;
    uint64_t bytes;
    (void)state;
    make(&b, "depth_cache_bytes=2048 depth_cache_ways=4");
    memory *m = begin(&b);
    const uint32_t lines = (uint32_t)(b.machine.depth_cache_bytes * b.machine.partitions / b.machine.line_bytes);
    touch *used = calloc(BLOCKS, sizeof *used);
    assert_non_null(used);
    assert_true(BLOCKS > 2 * lines);
    for (uint32_t tile = 0; tile < BLOCKS; tile++)
        used[tile] = (touch){tile, false, tile + 1};
    tell(m, used, BLOCKS, true);
    for (uint32_t tile = 0; tile < BLOCKS / 4; tile++)  // which are not there any more
        memory_pass_over(m, tile, 1, UINT64_MAX, BLOCKS + 1);
    assert_int_equal(flush(m, &bytes), 0);
    assert_int_equal(bytes, 0);
    memory_begin_pass(m, &(pass_info){.kind = PASS_DRAW}, &(statistics){0});
    for (uint32_t tile = 0; tile < BLOCKS; tile++)  // another pass has used nothing yet
        memory_pass_over(m, tile, 1, UINT64_MAX, BLOCKS + 1 + tile);
    const uint64_t written = flush(m, &bytes);
    assert_true(written > lines / 2 && written <= lines);
    memory_destroy(m);
    free(used);
    drop(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_order_gives_the_same_lines),
        cmocka_unit_test(changed_unseen_is_written_at_the_end),
        cmocka_unit_test(changed_unseen_takes_no_place_of_what_is_used),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

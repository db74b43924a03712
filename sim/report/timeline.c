// A timeline of a run as Chrome trace events (the "Trace Event Format"), which Perfetto and chrome://tracing open.
// Streamed.
//
// Times in the file are microseconds of the machine, cut to whole nanoseconds where a cycle is at least one: viewers
// keep no more, and slices that meet must meet in the viewer as well. Faster clocks get picoseconds. Distinct cycles
// stay distinct either way. Lengths are differences of cut times, so that slices that lie within each other stay so.
#include "../levels.h"

#include <assert.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

enum { PROCESS = 1, TRACK_PASSES = 1, TRACK_FIRST = 2, TABLE_SIZE = 2 * TIMELINE_TRACKS };

struct timeline {
    aside *aside;
    FILE *file;
    uint64_t core_mhz;
    uint64_t units;           // of time in a microsecond: 1000 or 1000000
    bool begun;               // an event stands before
    uint64_t iteration, end;  // of the last pass
    int track_count;
    int slots[TABLE_SIZE];  // hash of a name to a track's index + 1; 0: free
    char names[TIMELINE_TRACKS][NAME_SIZE];
};

static uint64_t in_units(const timeline *timeline, uint64_t cycle)
{
    return cycle / timeline->core_mhz * timeline->units +
           cycle % timeline->core_mhz * timeline->units / timeline->core_mhz;
}

static void write_time(const timeline *timeline, const char *key, uint64_t units)
{
    fprintf(timeline->file, ",\"%s\":%" PRIu64 ".%0*" PRIu64, key, units / timeline->units,
            timeline->units == 1000 ? 3 : 6, units % timeline->units);
}

// Quoted; names that are not UTF-8 (a machine is called as its file is) are left out.
static void write_text(FILE *file, const char *text)
{
    json_t *string = json_string(text);
    if (!string || json_dumpf(string, file, JSON_ENCODE_ANY) != 0)
        fputs("\"\"", file);
    json_decref(string);
}

// Opens an event up to its time and length; the caller closes the brace.
static void begin_event(timeline *timeline, char phase, int track, const char *name)
{
    fputs(timeline->begun ? ",\n" : "\n", timeline->file);
    timeline->begun = true;
    fprintf(timeline->file, "{\"ph\":\"%c\",\"pid\":%d,\"tid\":%d,\"name\":", phase, PROCESS, track);
    write_text(timeline->file, name);
}

static void write_metadata(timeline *timeline, const char *what, int track, const char *name)
{
    begin_event(timeline, 'M', track, what);
    fputs(",\"args\":{\"name\":", timeline->file);
    write_text(timeline->file, name);
    fputs("}}", timeline->file);
}

// Viewers sort tracks by this number instead of by their names.
static void name_track(timeline *timeline, int track, const char *name)
{
    write_metadata(timeline, "thread_name", track, name);
    begin_event(timeline, 'M', track, "thread_sort_index");
    fprintf(timeline->file, ",\"args\":{\"sort_index\":%d}}", track);
}

// The track's number; of a new one its name is written.
static int find_track(timeline *timeline, const char *name)
{
    uint32_t hash = 2166136261U;  // FNV-1a
    for (const char *letter = name; *letter; letter++)
        hash = (hash ^ (unsigned char)*letter) * 16777619U;
    uint32_t slot = hash % TABLE_SIZE;
    for (; timeline->slots[slot] > 0; slot = (slot + 1) % TABLE_SIZE) {
        const int index = timeline->slots[slot] - 1;
        if (strncmp(timeline->names[index], name, NAME_SIZE - 1) == 0)
            return TRACK_FIRST + index;
    }
    assert(timeline->track_count < TIMELINE_TRACKS);
    const int index = timeline->track_count++;
    timeline->slots[slot] = index + 1;
    snprintf(timeline->names[index], NAME_SIZE, "%s", name);
    name_track(timeline, TRACK_FIRST + index, timeline->names[index]);
    return TRACK_FIRST + index;
}

// A slice up to its arguments.
static void begin_slice(timeline *timeline, int track, const char *name, uint64_t start, uint64_t end)
{
    const uint64_t from = in_units(timeline, start);
    begin_event(timeline, 'X', track, name);
    write_time(timeline, "ts", from);
    write_time(timeline, "dur", in_units(timeline, end) - from);
}

status timeline_open(const char *path, const machine *machine, const report *report, timeline **timeline)
{
    struct timeline *new = calloc(1, sizeof *new);
    char process[NAME_SIZE + 16];
    *timeline = NULL;
    if (!new)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    const status status = aside_open(path, report, &new->aside, &new->file);
    if (status != STATUS_OK) {
        free(new);
        return status;
    }
    new->core_mhz = (uint64_t)machine->core_mhz;
    new->units = machine->core_mhz <= 1000 ? 1000 : 1000000;
    fputs("{\"displayTimeUnit\":\"ns\",\"traceEvents\":[", new->file);
    snprintf(process, sizeof process, "ropsim on %s", machine->name);
    write_metadata(new, "process_name", 0, process);
    name_track(new, TRACK_PASSES, "passes");
    *timeline = new;
    return STATUS_OK;
}

// An iteration's end is known when another begins: it is written as begin and end, its passes between.
static void end_iteration(timeline *timeline)
{
    if (timeline->iteration == 0)
        return;
    begin_event(timeline, 'E', TRACK_PASSES, "iteration");
    write_time(timeline, "ts", in_units(timeline, timeline->end));
    fputc('}', timeline->file);
}

static void begin_iteration(timeline *timeline, uint64_t iteration, uint64_t start)
{
    timeline->iteration = iteration;
    if (iteration == 0)
        return;
    begin_event(timeline, 'B', TRACK_PASSES, "iteration");
    write_time(timeline, "ts", in_units(timeline, start));
    fprintf(timeline->file, ",\"args\":{\"number\":%" PRIu64 "}}", iteration);
}

// A value holds until the next: the stalls of a pass, in one event, are seen as long as it runs.
static void write_stalls(timeline *timeline, uint64_t cycle, const statistics *statistics)
{
    begin_event(timeline, 'C', 0, "stalls");
    write_time(timeline, "ts", in_units(timeline, cycle));
    const char *separator = ",\"args\":{";
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        if (!statistic_is_stall(i))
            continue;
        fprintf(timeline->file, "%s\"%s\":%" PRIu64, separator, statistic_rows[i].name, statistic_value(statistics, i));
        separator = ",";
    }
    fputs("}}", timeline->file);
}

void timeline_pass(timeline *timeline, const pass_record *pass)
{
    if (pass->info.iteration != timeline->iteration) {
        end_iteration(timeline);
        begin_iteration(timeline, pass->info.iteration, pass->start);
    }
    begin_slice(timeline, TRACK_PASSES, pass->info.name, pass->start, pass->drained);
    fprintf(timeline->file,
            ",\"args\":{\"number\":%" PRIu64 ",\"kind\":\"%s\",\"bound_by\":\"%s\",\"cycles\":%" PRIu64
            ",\"fragments\":%" PRIu64 ",\"memory_bytes_read\":%" PRIu64 ",\"memory_bytes_written\":%" PRIu64 "}}",
            pass->info.number, pass_kind_names[pass->info.kind], clock_resource_names[pass->bound_by],
            pass->drained - pass->start, pass->statistics.fragments, pass->statistics.memory_bytes_read,
            pass->statistics.memory_bytes_written);
    write_stalls(timeline, pass->start, &pass->statistics);
    timeline->end = pass->drained;
}

void timeline_slice(timeline *timeline, const char *track, const char *name, uint64_t start, uint64_t end)
{
    begin_slice(timeline, find_track(timeline, track), name, start, end);
    fputc('}', timeline->file);
}

void timeline_counter(timeline *timeline, const char *track, uint64_t time, double value)
{
    begin_event(timeline, 'C', 0, track);
    write_time(timeline, "ts", in_units(timeline, time));
    fprintf(timeline->file, ",\"args\":{\"value\":%.17g}}", value);
}

status timeline_finish(timeline *timeline)
{
    end_iteration(timeline);
    write_stalls(timeline, timeline->end, &(statistics){0});
    fputs("\n]}\n", timeline->file);
    const status status = aside_finish(timeline->aside);
    free(timeline);
    return status;
}

void timeline_discard(timeline *timeline)
{
    if (!timeline)
        return;
    aside_discard(timeline->aside);
    free(timeline);
}

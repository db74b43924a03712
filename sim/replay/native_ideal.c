// Algorithm 2 (mended) written by hand in C over the same bins: what a program of the replay is measured against.
//
// One tile from start to end, 64 lanes a loop, for the compiler to vectorize; compiled once for each vector
// width, as execute.c is. It knows its one algorithm: formats are 32-bit floats, nothing is counted, and a tile
// that has ended is not visited again. Absent lanes hold depth 0, which no test lets pass.
#include "native_ideal.h"

#include <string.h>

typedef struct native_tile {
    uint32_t opaque[TILE_LANES], peel[TILE_LANES], z1[TILE_LANES], z2[TILE_LANES], z3[TILE_LANES], post[TILE_LANES];
    float front[4][TILE_LANES], base[3][TILE_LANES];
} native_tile;

static void draw_opaque(native_tile *t, const native_batch *batch)
{
    for (int l = 0; l < TILE_LANES; l++) {
        const uint32_t z = batch->depth[l];
        const bool nearer = batch->lanes >> l & 1 && z < t->opaque[l];
        for (int c = 0; c < 3; c++)
            t->base[c][l] = nearer ? batch->rgba[c][l] : t->base[c][l];
        t->opaque[l] = nearer ? z : t->opaque[l];
    }
}

// Under-blends the lanes of the mask.
static void composite(native_tile *t, const native_batch *batch, const uint32_t mask[TILE_LANES])
{
    for (int l = 0; l < TILE_LANES; l++) {
        const float alpha = batch->rgba[3][l], transmittance = t->front[3][l];
        for (int c = 0; c < 3; c++) {
            const float sum = batch->rgba[c][l] * alpha * transmittance + t->front[c][l];
            t->front[c][l] = mask[l] ? sum : t->front[c][l];
        }
        t->front[3][l] = mask[l] ? transmittance * (1.0f - alpha) : transmittance;
    }
}

static bool search(native_tile *t, const native_batch *batch)
{
    uint32_t composited[TILE_LANES], any_found = 0, any_composited = 0;
    for (int l = 0; l < TILE_LANES; l++) {
        const uint32_t z = batch->depth[l], peel = t->peel[l], z1 = t->z1[l], z2 = t->z2[l], z3 = t->z3[l], post = t->post[l];
        const uint32_t found = (z > peel) & (z < z2), first = found & (z < z1), later = found & (z >= z1), before = z < z3;
        t->z1[l] = first ? z : z1;
        t->z2[l] = first ? z1 : z2;
        t->z3[l] = first | (later & (before | (post == 0))) ? z : z3;
        t->post[l] = first ? 0 : post | (later & before);
        composited[l] = (z == peel) & (z != 0) & (z < t->opaque[l]);
        any_found |= found;
        any_composited |= composited[l];
    }
    if (any_composited)
        composite(t, batch, composited);
    return any_found;
}

static void composite_span(native_tile *t, const native_batch *batch)
{
    uint32_t inside[TILE_LANES], any = 0;
    for (int l = 0; l < TILE_LANES; l++) {
        const uint32_t z = batch->depth[l];
        inside[l] = (z > t->peel[l]) & (z < t->z3[l]);
        any |= inside[l];
    }
    if (any)
        composite(t, batch, inside);
}

static void start(native_tile *t, const float background[4])
{
    memset(t, 0, sizeof *t);
    for (int l = 0; l < TILE_LANES; l++) {
        t->opaque[l] = format_far_code(FORMAT_z32f);
        t->front[3][l] = 1.0f;
        for (int c = 0; c < 3; c++)
            t->base[c][l] = background[c];
    }
}

native_tile_run NATIVE_NAME;

uint64_t NATIVE_NAME(const native_batch *batches, uint32_t opaque_count, uint32_t count, const float background[4],
                     float rgb[TILE_LANES][3])
{
    native_tile tile, *const t = &tile;
    uint64_t passes = 0;
    start(t, background);
    for (uint32_t r = 0; r < opaque_count; r++)
        draw_opaque(t, &batches[r]);
    for (bool changed = true; changed;) {
        changed = false;
        memcpy(t->z1, t->opaque, sizeof t->z1);
        memcpy(t->z2, t->opaque, sizeof t->z2);
        memcpy(t->peel, t->z3, sizeof t->peel);
        memcpy(t->z3, t->opaque, sizeof t->z3);
        memset(t->post, 0, sizeof t->post);
        for (uint32_t r = opaque_count; r < count; r++)
            changed |= search(t, &batches[r]);
        passes++;
        for (uint32_t r = opaque_count; changed && r < count; r++)
            composite_span(t, &batches[r]);
        passes += changed;
    }
    for (int l = 0; l < TILE_LANES; l++)
        for (int c = 0; c < 3; c++)
            rgb[l][c] = t->front[c][l] + t->front[3][l] * t->base[c][l];
    return passes;
}

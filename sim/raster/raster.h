// The recorder's stages, in the order in which a triangle meets them:
//
//   "class:FILE", "scene:NAME,key=value" --scene_add--> models --view_fit--> view
//   model --triangle_order--> triangles in draw order --shade_corner--> colours
//     --view_project--> clip_vertex --clip_triangle--> polygon --snap_vertex--> screen_vertex
//     --raster_triangle--> fragments --> sink
//
// Everything up to snapping is double; from there on positions are integers in 1/256 pixel, and what a
// triangle covers is decided by integers alone. Internal to sim/raster and its tests; docs/record.md is
// the manual.
#ifndef ROPSIM_RASTER_H
#define ROPSIM_RASTER_H

#include "../sim.h"

enum {
    SUBPIXEL_BITS = 8,
    SUBPIXELS = 1 << SUBPIXEL_BITS,
    RASTER_TILE = 8,          // pixels a side: triangles are walked tile by tile
    CLIP_VERTEX_MAX = 3 + 6,  // a triangle cut by near, far and the four sides of the guard band
};

// ---- Models and scenes (model.c, scene.c) --------------------------------------------------------------

// One draw: geometry, and how to shade it. `mesh` belongs to the model.
typedef struct model {
    char name[NAME_SIZE];
    draw_class class;
    mesh *mesh;
    bool unlit;      // the mesh's colours are final: no light, no --alpha
    bool has_frame;  // the camera fits frame[0]..frame[1] instead of the vertices
    double frame[2][3];
} model;

typedef struct model_list {
    model *models;
    uint32_t count;
} model_list;

// A mesh of zeroed arrays with vertex normals and colours, to be filled; NULL if memory ran out.
mesh *mesh_allocate(uint32_t vertices, uint32_t triangles);
// Adds a draw of a mesh, which the list then owns, also on failure (a NULL mesh fails: out of memory). The
// name keeps letters, digits and "._-". On success *model, if asked for, is valid until the next call.
status model_add(model_list *list, const char *name, draw_class class, mesh *mesh, const report *report, model **model);
void model_list_clear(model_list *list);

// Adds the draws of one `[class:]FILE` or `[class:]scene:NAME[,key=value...]`.
status scene_add(const char *text, const report *report, model_list *list);
// Lists the keys of a scene with ranges, defaults and meanings, a line each; NULL: of all scenes, with their
// names. `key`: that one only, or NULL.
void scene_print_help(const char *scene, const char *key, FILE *out);

// Every key of every scene: KEY_<scene>_<key>.
typedef enum scene_key {
#define SCENE(name, summary)
#define SCENE_NUMBER(scene, key, whole, initial, low, high, meaning) KEY_##scene##_##key,
#define SCENE_WORD(scene, key, words, initial, low, high, meaning) KEY_##scene##_##key,
#include "scenes.def"
    SCENE_KEY_COUNT
} scene_key;

// What the user asked of a scene, checked; only the scene's own keys are set.
typedef struct scene_request {
    struct {
        double number;  // the value, or a word's own number where it has one (block:8)
        int word;       // index into the key's words
    } values[SCENE_KEY_COUNT];
    bool has_class;  // a class was given: it holds for every draw of the scene
    draw_class class;
} scene_request;

// Builders, one a row of scenes.def, in scene_<name>.c.
#undef SCENE
#undef SCENE_NUMBER
#undef SCENE_WORD
#define SCENE(name, summary) status scene_##name(const scene_request *request, const report *report, model_list *list);
#define SCENE_NUMBER(scene, key, whole, initial, low, high, meaning)
#define SCENE_WORD(scene, key, words, initial, low, high, meaning)
#include "scenes.def"
#undef SCENE
#undef SCENE_NUMBER
#undef SCENE_WORD

// ---- Numbers that are the same everywhere (angle.c, random.c) -------------------------------------------

// Sine and cosine of an angle in turns (1 is 360 degrees), to 2 ulp. libm's last digit differs from one
// version to the next; these use + - * only.
void angle_sin_cos(double turns, double *sine, double *cosine);
double angle_tangent(double turns);

// SplitMix64: a state of one word, any seed.
uint64_t random_next(uint64_t *state);
double random_unit(uint64_t *state);                     // in [0, 1), multiples of 2^-53
uint64_t random_below(uint64_t *state, uint64_t bound);  // bound > 0

// ---- Camera (view.c, view_fit.c) ------------------------------------------------------------------------

// A camera with everything settled. View space: x right, y up, distance along `forward` from the eye.
typedef struct view {
    double eye[3], right[3], up[3], forward[3];
    double scale[2];  // clip x = scale[0] * view x; clip y = scale[1] * view y
    double near, far;
    bool ortho, reverse_z;
    uint32_t width, height;
} view;

// A vertex in homogeneous clip space. Depth is kept as the two distances from its planes, so that either
// end can be computed without cancellation: depth = far / (far - near) * past_near / w, and
// 1 - depth = near / (far - near) * before_far / w (ortho: both over far - near, and w is 1).
typedef struct clip_vertex {
    double x, y, w;                // visible: |x| <= w, |y| <= w
    double past_near, before_far;  // visible: >= 0
    double rgba[4];
} clip_vertex;

// Settles what the camera leaves open from the models' bounds. docs/record.md says how.
status view_fit(const camera *camera, const model_list *models, uint32_t width, uint32_t height, const report *report,
                view *view);
// Fills position, not colour.
void view_project(const view *view, const float position[3], clip_vertex *vertex);
// Unit vector from a point towards the eye.
void view_direction(const view *view, const float position[3], double direction[3]);

// ---- Draw order and shading (triangle_order.c, shade.c) ---------------------------------------------------

// Writes the draw's triangle numbers in draw order to `order[triangle_count]`.
status triangle_order_fill(const model *model, const view *view, triangle_order kind, uint64_t parameter,
                           const report *report, uint32_t *order);

// Straight RGBA of a corner of a triangle.
void shade_corner(const model *model, const view *view, double alpha, uint32_t triangle, int corner, double rgba[4]);

// ---- Triangles to fragments (frustum_clip.c, triangle_setup.c, coverage.c, fragment_buffer.c) ---------------

typedef struct screen_vertex {
    int64_t x, y;  // 1/256 pixel from the top left corner of the image, y down
    double depth;  // device depth: 0 near, or 1 near where reversed
    double inverse_w;
    double rgba[4];
} screen_vertex;

// Cuts a triangle by near, far and, where a corner is far outside, the guard band. Returns the number of
// vertices of the polygon, 0 if nothing is left. Cut edges give the same points from both sides.
int clip_triangle(const view *view, const clip_vertex triangle[3], clip_vertex polygon[CLIP_VERTEX_MAX]);
void snap_vertex(const view *view, const clip_vertex *vertex, screen_vertex *screen);

// Where fragments go: whole runs, arrays valid during the call.
typedef struct fragment_sink {
    status (*take)(void *user, const fragments *fragments);
    void *user;
} fragment_sink;

typedef struct rasterizer rasterizer;
// Only size, samples, positions and reversed_depth of `info` are used. NULL if memory ran out. Free with
// rasterizer_destroy; both flush nothing.
rasterizer *rasterizer_create(const trace_info *info, fragment_sink sink);
void rasterizer_destroy(rasterizer *rasterizer);
// Emits the fragments of one triangle, tile by tile, row by row, sample by sample.
status raster_triangle(rasterizer *rasterizer, const screen_vertex corners[3], uint32_t primitive);
status rasterizer_flush(rasterizer *rasterizer);  // hands on what is still buffered

#endif

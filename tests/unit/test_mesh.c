// Mesh files of each format: what is read, what is dropped, what is refused. Files are written by the test.
#include "messages.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <unistd.h>
#include <cmocka.h>

typedef struct folder {
    char path[64], file[128];
} folder;

static int start(void **state)
{
    folder *folder = calloc(1, sizeof *folder);
    strcpy(folder->path, "/tmp/ropsim-mesh-XXXXXX");
    *state = folder;
    return mkdtemp(folder->path) ? 0 : -1;
}

static int stop(void **state)
{
    folder *folder = *state;
    int result = rmdir(folder->path);
    free(folder);
    return result;
}

// Writes bytes to NAME, loads it and removes it.
static status load_bytes(folder *folder, const char *name, const void *bytes, size_t size, messages *said, mesh **mesh)
{
    snprintf(folder->file, sizeof folder->file, "%s/%s", folder->path, name);
    FILE *out = fopen(folder->file, "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(bytes, 1, size, out), size);
    fclose(out);
    messages_start(said);
    status result = mesh_load(folder->file, &said->report, mesh);
    unlink(folder->file);
    assert_true((result == STATUS_OK) == (*mesh != NULL));
    return result;
}

static mesh *load(void **state, const char *name, const char *text, messages *said)
{
    mesh *mesh;
    status result = load_bytes(*state, name, text, strlen(text), said, &mesh);
    if (result)
        fail_msg("%s: %s", name, said->text);
    return mesh;
}

// It must be refused, with the file's name and `reason` in the message.
static void refuse(void **state, const char *name, const char *text, const char *reason)
{
    messages said;
    mesh *mesh;
    assert_int_equal(load_bytes(*state, name, text, strlen(text), &said, &mesh), STATUS_REFUSED);
    if (!strstr(said.text, name) || !strstr(said.text, reason))
        fail_msg("%s: expected '%s' in: %s", name, reason, said.text);
}

static const char PLY_QUAD[] =
    "ply\nformat ascii 1.0\ncomment a quad and a triangle\nelement vertex 5\nproperty float x\nproperty float "
    "y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar "
    "blue\nproperty uchar alpha\n"
    "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0.5 0.5\n4 0 1 2 3 255 0 0 51\n3 1 4 2 0 255 0 255\n";
static const char OFF_QUAD[] =
    "OFF\n# a quad and a triangle\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0.5 0.5\n4 0 1 2 3 255 0 0\n3 1 4 2 0 255 0\n";
static const char OBJ_QUAD[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0.5 0.5\nf 1 2 3 4\nf 2 5 3\n";
static const char STL_TWO[] =
    "solid two\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid two\n";
// The quad and the triangle as OpenMesh 9 writes them: half-edges, no attributes.
static const unsigned char OM_QUAD[] = {
    0x4f, 0x4d, 0x50, 0x42, 0x05, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x06, 0x00, 0x00, 0x00, 0x00, 0x16, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x40, 0x00, 0x00, 0x00, 0x3f, 0x00, 0x00,
    0x00, 0x3f, 0xf8, 0x16, 0x02, 0x01, 0x00, 0x07, 0x00, 0xff, 0x04, 0x02, 0x00, 0x08, 0x01, 0x01, 0x06, 0x03, 0x00,
    0x0b, 0x02, 0xff, 0x00, 0x00, 0x00, 0x05, 0x03, 0xff, 0x0a, 0x04, 0x01, 0x01, 0x01, 0xff, 0x03, 0x02, 0x01, 0x09,
    0x04, 0xff, 0xe0, 0x06, 0x07, 0x01, 0x0b, 0x05, 0x09, 0xe8, 0x06, 0x06, 0x03, 0x1c, 0x00,
};

static void check_quad(const mesh *mesh)
{
    static const uint32_t triangles[3][3] = {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}};
    assert_int_equal(mesh->vertex_count, 5);
    assert_int_equal(mesh->face_count, 2);
    assert_int_equal(mesh->dropped_faces, 0);
    assert_int_equal(mesh->triangle_count, 3);
    assert_memory_equal(mesh->triangles, triangles, sizeof triangles);
    assert_int_equal(mesh->face_of_triangle[1], 0);
    assert_int_equal(mesh->face_of_triangle[2], 1);
    assert_true(mesh->positions[4][0] == 2 && mesh->positions[4][2] == 0.5f);
    assert_true(mesh->vertex_normals[0][2] == 1);  // the quad's, by area
}

static void polygons_become_fans(void **state)
{
    messages said;
    mesh *mesh = load(state, "quad.off", OFF_QUAD, &said);
    check_quad(mesh);
    mesh_destroy(mesh);
    mesh = load(state, "quad.OBJ", OBJ_QUAD, &said);
    check_quad(mesh);
    assert_null(mesh->face_colors);
    assert_null(mesh->vertex_colors);
    mesh_destroy(mesh);
    assert_int_equal(load_bytes(*state, "quad.om", OM_QUAD, sizeof OM_QUAD, &said, &mesh), STATUS_OK);
    // OM keeps a face as a ring of half-edges: its first corner may be another.
    assert_int_equal(mesh->triangle_count, 3);
    assert_int_equal(mesh->vertex_count, 5);
    mesh_destroy(mesh);
}

static void face_colors_reach_every_triangle(void **state)
{
    messages said;
    mesh *mesh = load(state, "quad.ply", PLY_QUAD, &said);
    check_quad(mesh);
    assert_non_null(mesh->face_colors);
    assert_null(mesh->vertex_colors);
    assert_true(mesh->colors_have_alpha);
    for (int t = 0; t < 2; t++)
        assert_true(mesh->face_colors[t][0] == 1 && mesh->face_colors[t][1] == 0 &&
                    mesh->face_colors[t][3] == 51 / 255.0f);
    assert_true(mesh->face_colors[2][1] == 1 && mesh->face_colors[2][3] == 1);
    mesh_destroy(mesh);
    mesh = load(state, "quad.off", OFF_QUAD, &said);
    assert_non_null(mesh->face_colors);
    assert_true(mesh->face_colors[0][0] == 1 && mesh->face_colors[1][0] == 1 && mesh->face_colors[2][1] == 1);
    assert_false(mesh->colors_have_alpha);
    mesh_destroy(mesh);
}

static void vertex_colors_are_read(void **state)
{
    messages said;
    mesh *mesh = load(state, "c.ply",
                      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
                      "z\nproperty uchar red\n"
                      "property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int "
                      "vertex_indices\nend_header\n"
                      "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 51\n3 0 1 2\n",
                      &said);
    assert_non_null(mesh->vertex_colors);
    assert_false(mesh->colors_have_alpha);
    assert_true(mesh->vertex_colors[0][0] == 1 && mesh->vertex_colors[1][1] == 1 &&
                mesh->vertex_colors[2][2] == 51 / 255.0f);
    mesh_destroy(mesh);
    mesh =
        load(state, "c.off", "COFF\n3 1 0\n0 0 0 255 0 0 51\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n3 0 1 2\n", &said);
    assert_non_null(mesh->vertex_colors);
    assert_true(mesh->vertex_colors[0][3] == 51 / 255.0f);
    assert_true(mesh->colors_have_alpha);
    mesh_destroy(mesh);
}

static void stl_is_read_in_both_forms(void **state)
{
    messages said;
    mesh *mesh = load(state, "two.stl", STL_TWO, &said);
    assert_int_equal(mesh->triangle_count, 2);
    assert_int_equal(mesh->vertex_count, 4);
    mesh_destroy(mesh);

    unsigned char binary[84 + 50] = "solid, although binary";
    const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    binary[80] = 1;
    memcpy(binary + 84 + 12, corners, sizeof corners);
    assert_int_equal(load_bytes(*state, "one.stl", binary, sizeof binary, &said, &mesh), STATUS_OK);
    assert_int_equal(mesh->triangle_count, 1);
    mesh_destroy(mesh);
    binary[80] = 2;
    assert_int_equal(load_bytes(*state, "two.stl", binary, sizeof binary, &said, &mesh), STATUS_REFUSED);
    binary[0] = 'x';
    assert_int_equal(load_bytes(*state, "two.stl", binary, sizeof binary, &said, &mesh), STATUS_REFUSED);
    assert_non_null(strstr(said.text, "two.stl: 134 bytes, but a binary STL file of 2 triangles has 184"));
}

static void duplicates_and_non_manifold_faces_stay(void **state)
{
    messages said;
    mesh *mesh = load(
        state, "fan.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 3\nf 3 2 1\nf 1 2 4\nf 1 2 5\nf 2 2 3\n", &said);
    assert_int_equal(mesh->triangle_count, 5);
    assert_int_equal(mesh->vertex_count, 5);
    assert_int_equal(mesh->dropped_faces, 1);  // the one that repeats a corner
    assert_non_null(strstr(said.text, "left out 1 of 6 faces"));
    mesh_destroy(mesh);
}

static void what_is_not_there_is_dropped_and_said(void **state)
{
    messages said;
    mesh *mesh = load(state, "holes.off", "OFF\n3 3 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n2 0 1\n3 0 1 9\n", &said);
    assert_int_equal(mesh->triangle_count, 1);
    assert_int_equal(mesh->dropped_faces, 2);
    assert_non_null(strstr(said.text, "left out 2 of 3 faces"));
    mesh_destroy(mesh);
}

static void hostile_files_are_refused(void **state)
{
    refuse(state, "a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "no end_header");
    refuse(state, "b.ply",
           "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n",
           "more elements");
    refuse(state, "c.ply",
           "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uint int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n",
           "longer than the rest");
    refuse(state, "d.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty quad y\nend_header\n",
           "a type that PLY has not");
    refuse(state, "e.ply", "plx\n", "begins with a line `ply`");
    refuse(state, "f.ply",
           "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty float q\nend_header\n0 0 0\n1\n",
           "vertex_indices");
    refuse(state, "a.off", "OFF\n4000000000 1 0\n0 0 0\n", "more than the file can hold");
    refuse(state, "b.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n", "fewer corners");
    refuse(state, "c.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends within its faces");
    refuse(state, "d.off", "OFF BINARY\n", "binary OFF");
    refuse(state, "e.off", "OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", "e.off:4: a vertex has three coordinates");
    refuse(state, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1\n", "three coordinates");
    refuse(state, "b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2", "three corners");
    refuse(state, "c.obj", "v 0 0 0\n", "no face");
    refuse(state, "d.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 5 6 7\n", "");
    refuse(state, "a.om", "OMTB\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff", "announces");
    refuse(state, "b.om", "not one", "does not begin");
}

// Cut anywhere, a file is refused or, at a line's end of an OBJ file, smaller; never a crash or a hang.
static void truncation_is_noticed(void **state)
{
    const struct {
        const char *name;
        const void *bytes;
        size_t size;
        bool tail_optional;
    } files[] = {
        {"t.ply", PLY_QUAD, sizeof PLY_QUAD - 1, false}, {"t.off", OFF_QUAD, sizeof OFF_QUAD - 1, false},
        {"t.stl", STL_TWO, sizeof STL_TWO - 1, false},   {"t.om", OM_QUAD, sizeof OM_QUAD, false},
        {"t.obj", OBJ_QUAD, sizeof OBJ_QUAD - 1, true},
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        for (size_t size = 1; size < files[i].size; size++) {
            messages said;
            mesh *mesh;
            status result = load_bytes(*state, files[i].name, files[i].bytes, size, &said, &mesh);
            // The last number may lose digits, a name its end, and nobody can tell.
            bool near_end = size + 16 > files[i].size;
            if (result == STATUS_OK && !near_end && !files[i].tail_optional)
                fail_msg("%s: %zu of %zu bytes were accepted", files[i].name, size, files[i].size);
            mesh_destroy(mesh);
        }
    }
}

// Any single byte changed: refused, or a mesh whose every index is in range.
static void damaged_bytes_do_no_harm(void **state)
{
    const struct {
        const char *name;
        const void *bytes;
        size_t size;
    } files[] = {
        {"t.ply", PLY_QUAD, sizeof PLY_QUAD - 1}, {"t.om", OM_QUAD, sizeof OM_QUAD},
        {"t.off", OFF_QUAD, sizeof OFF_QUAD - 1}, {"t.obj", OBJ_QUAD, sizeof OBJ_QUAD - 1},
        {"t.stl", STL_TWO, sizeof STL_TWO - 1},
    };
    static const unsigned char values[] = {0x00, 0x7f, 0xff, '9', '-'};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        for (size_t at = 0; at < files[i].size * sizeof values; at++) {
            unsigned char copy[512];
            messages said;
            mesh *mesh;
            assert_true(files[i].size <= sizeof copy);
            memcpy(copy, files[i].bytes, files[i].size);
            copy[at / sizeof values] = values[at % sizeof values];
            if (load_bytes(*state, files[i].name, copy, files[i].size, &said, &mesh))
                continue;
            for (uint32_t t = 0; t < mesh->triangle_count; t++)
                for (int corner = 0; corner < 3; corner++)
                    assert_true(mesh->triangles[t][corner] < mesh->vertex_count);
            mesh_destroy(mesh);
        }
    }
}

static void paths_are_named(void **state)
{
    messages said;
    mesh *mesh;
    (void)state;
    messages_start(&said);
    assert_int_equal(mesh_load("/nowhere/x.ply", &said.report, &mesh), STATUS_IO);
    assert_non_null(strstr(said.text, "/nowhere/x.ply: No such file"));
    assert_int_equal(mesh_load("x.gltf", &said.report, &mesh), STATUS_USAGE);
    assert_non_null(strstr(said.text, ".obj, .ply, .off, .stl and .om"));
    mesh_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(polygons_become_fans),
        cmocka_unit_test(face_colors_reach_every_triangle),
        cmocka_unit_test(vertex_colors_are_read),
        cmocka_unit_test(stl_is_read_in_both_forms),
        cmocka_unit_test(duplicates_and_non_manifold_faces_stay),
        cmocka_unit_test(what_is_not_there_is_dropped_and_said),
        cmocka_unit_test(hostile_files_are_refused),
        cmocka_unit_test(truncation_is_noticed),
        cmocka_unit_test(damaged_bytes_do_no_harm),
        cmocka_unit_test(paths_are_named),
    };
    return cmocka_run_group_tests_name("mesh", tests, start, stop);
}

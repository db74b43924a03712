// Layers across the view at evenly spaced z in [-1, 1], drawn in a chosen order.
//
// A layer is one triangle much larger than the view, so that every pixel is covered whatever the picture's shape;
// the camera fits the frame [-1, 1]^3, not the triangles. Layer 0 is the nearest (z = 1).
#include "raster.h"

#include <stdlib.h>

typedef enum sheet_order { SHEETS_SORTED, SHEETS_REVERSED, SHEETS_SHUFFLED, SHEETS_BLOCK } sheet_order;

static void fill_order(uint32_t *layers, uint32_t count, const scene_request *request)
{
    uint64_t state = (uint64_t)request->values[KEY_sheets_seed].number;
    uint32_t block = (uint32_t)request->values[KEY_sheets_order].number, next = 0;
    switch ((sheet_order)request->values[KEY_sheets_order].word) {
    case SHEETS_REVERSED:
        for (uint32_t i = 0; i < count; i++)
            layers[i] = count - 1 - i;
        break;
    case SHEETS_BLOCK:
        for (uint32_t first = (count - 1) / block * block; next < count; first -= block)
            for (uint32_t i = first; i < first + block && i < count; i++)
                layers[next++] = i;
        break;
    default:
        for (uint32_t i = 0; i < count; i++)
            layers[i] = i;
    }
    if (request->values[KEY_sheets_order].word != SHEETS_SHUFFLED)
        return;
    for (uint32_t i = count; i > 1; i--) {
        uint32_t j = (uint32_t)random_below(&state, i), swapped = layers[i - 1];
        layers[i - 1] = layers[j];
        layers[j] = swapped;
    }
}

// Hues run once around a soft wheel from the nearest layer to the farthest.
static void color_layer(uint32_t layer, uint32_t count, double alpha, float rgba[4])
{
    for (int i = 0; i < 3; i++) {
        double sine, cosine;
        angle_sin_cos((double)layer / count - i / 3.0, &sine, &cosine);
        rgba[i] = (float)(0.55 + 0.35 * cosine);
    }
    rgba[3] = (float)alpha;
}

status scene_sheets(const scene_request *request, const report *report, model_list *list)
{
    static const float corners[3][2] = {{-64, -64}, {192, -64}, {-64, 192}};
    uint32_t count = (uint32_t)request->values[KEY_sheets_count].number;
    uint32_t *layers = malloc(count * sizeof *layers);
    mesh *mesh = layers ? mesh_allocate(count * 3, count) : NULL;
    if (mesh)
        fill_order(layers, count, request);
    for (uint32_t t = 0; mesh && t < count; t++) {
        for (uint32_t corner = 0; corner < 3; corner++) {
            uint32_t vertex = t * 3 + corner;
            mesh->positions[vertex][0] = corners[corner][0];
            mesh->positions[vertex][1] = corners[corner][1];
            mesh->positions[vertex][2] = (float)(1 - (2.0 * layers[t] + 1) / count);
            color_layer(layers[t], count, request->values[KEY_sheets_alpha].number, mesh->vertex_colors[vertex]);
            mesh->triangles[t][corner] = vertex;
        }
    }
    free(layers);
    model *model;
    status result = model_add(list, "sheets", request->class, mesh, report, &model);
    if (result)
        return result;
    model->unlit = model->has_frame = true;
    for (int i = 0; i < 3; i++) {
        model->frame[0][i] = -1;
        model->frame[1][i] = 1;
    }
    return STATUS_OK;
}

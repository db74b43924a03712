// Random triangles with their centres in the cube [-1, 1]^3.
#include "raster.h"

status scene_soup(const scene_request *request, const report *report, model_list *list)
{
    uint32_t count = (uint32_t)request->values[KEY_soup_count].number;
    double size = request->values[KEY_soup_size].number, alpha = request->values[KEY_soup_alpha].number;
    uint64_t state = (uint64_t)request->values[KEY_soup_seed].number;
    mesh *mesh = mesh_allocate(count * 3, count);
    for (uint32_t t = 0; mesh && t < count; t++) {
        double centre[3], rgba[4];
        for (int i = 0; i < 3; i++)
            centre[i] = 2 * random_unit(&state) - 1;
        for (int i = 0; i < 3; i++)
            rgba[i] = 0.15 + 0.75 * random_unit(&state);
        rgba[3] = alpha * (0.5 + random_unit(&state));
        rgba[3] = rgba[3] < 1 ? rgba[3] : 1;
        for (uint32_t corner = 0; corner < 3; corner++) {
            uint32_t vertex = t * 3 + corner;
            for (int i = 0; i < 3; i++)
                mesh->positions[vertex][i] = (float)(centre[i] + size * (2 * random_unit(&state) - 1));
            for (int i = 0; i < 4; i++)
                mesh->vertex_colors[vertex][i] = (float)rgba[i];
            mesh->triangles[t][corner] = vertex;
        }
    }
    model *model;
    status result = model_add(list, "soup", request->class, mesh, report, &model);
    if (!result)
        model->unlit = true;
    return result;
}

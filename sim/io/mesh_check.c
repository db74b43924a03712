// Which check a mesh file gets, by its ending.
#include "mesh_check.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <strings.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static const struct {
    const char *ending;
    status (*check)(const mesh_bytes *file, mesh_promise *promise);
} formats[] = {
    {".obj", mesh_check_obj}, {".ply", mesh_check_ply}, {".off", mesh_check_off},
    {".stl", mesh_check_stl}, {".om", mesh_check_om},
};

static status check_open_file(const char *path, int file, int format, const report *report, mesh_promise *promise)
{
    struct stat about;
    if (fstat(file, &about))
        return report_error(report, STATUS_IO, "%s: %s", path, strerror(errno));
    if (!S_ISREG(about.st_mode) || about.st_size == 0)
        return report_error(report, STATUS_REFUSED, "%s: %s", path,
                            S_ISREG(about.st_mode) ? "is empty" : "is not a file");
    size_t size = (size_t)about.st_size;
    void *data = mmap(NULL, size, PROT_READ, MAP_PRIVATE, file, 0);
    if (data == MAP_FAILED)
        return report_error(report, STATUS_IO, "%s: %s", path, strerror(errno));
    *promise = (mesh_promise){.vertices = UINT64_MAX, .faces = UINT64_MAX, .file_bytes = size};
    mesh_bytes bytes = {path, report, data, size};
    status result = formats[format].check(&bytes, promise);
    munmap(data, size);
    return result;
}

status mesh_check(const char *path, const report *report, mesh_promise *promise)
{
    const char *ending = strrchr(path, '.');
    int count = (int)(sizeof formats / sizeof *formats), format = 0;
    while (format < count && (!ending || strcasecmp(ending, formats[format].ending) != 0))
        format++;
    if (format == count)
        return report_error(
            report, STATUS_USAGE,
            "%s: no mesh format has this ending; .obj, .ply, .off, .stl and .om are read, and scene:NAME is built in",
            path);
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return report_error(report, STATUS_IO, "%s: %s", path, strerror(errno));
    status result = check_open_file(path, file, format, report, promise);
    close(file);
    return result;
}

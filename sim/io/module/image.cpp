// RGB images through OpenImageIO. Goes in: pixels; comes out: a file that is the same bytes run by run.
#include "images.h"

#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <string>

namespace
{

int fail(char *why, size_t why_size, const std::string &reason)
{
    std::snprintf(why, why_size, "%s", reason.empty() ? "unknown reason" : reason.c_str());
    return 1;
}

int write_rgb(const char *path, const char *format, uint32_t width, uint32_t height, bool is_float, const void *pixels,
              char *why, size_t why_size)
{
    auto out = OIIO::ImageOutput::create(format);
    if (!out)
        return fail(why, why_size, OIIO::geterror());
    auto type = is_float ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
    OIIO::ImageSpec spec(int(width), int(height), 3, type);
    // Else the time of writing goes into the file, and no two runs give the same bytes.
    spec.attribute("DateTime", "2000:01:01 00:00:00");
    spec.attribute("oiio:ColorSpace", is_float ? "Linear" : "sRGB");
    if (is_float)
        spec.attribute("compression", "zip");
    if (!out->open(path, spec) || !out->write_image(type, pixels) || !out->close())
        return fail(why, why_size, out->geterror());
    return 0;
}

int read_rgb(const char *path, const char *format, uint64_t pixels_max, uint32_t *width, uint32_t *height, float **rgb,
             char *why, size_t why_size)
{
    auto in = OIIO::ImageInput::open(path);
    if (!in)
        return fail(why, why_size, OIIO::geterror());
    // OpenImageIO goes by content; a file that is not what its name says is somebody's mistake.
    if (std::strcmp(in->format_name(), format) != 0)
        return fail(why, why_size, std::string("its content is ") + in->format_name() + ", not " + format);
    const OIIO::ImageSpec &spec = in->spec();
    if (spec.deep || spec.nchannels < 3 || spec.width < 1 || spec.height < 1)
        return fail(why, why_size, "not a flat image of at least three channels");
    if (uint64_t(spec.width) * uint64_t(spec.height) > pixels_max)
        return fail(why, why_size, "more pixels than this reader takes");
    std::unique_ptr<float, decltype(&std::free)> pixels(
        static_cast<float *>(std::calloc(size_t(spec.width) * size_t(spec.height), 3 * sizeof(float))), std::free);
    if (!pixels)
        return fail(why, why_size, "out of memory");
    if (!in->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, pixels.get()))
        return fail(why, why_size, in->geterror());
    *width = uint32_t(spec.width);
    *height = uint32_t(spec.height);
    *rgb = pixels.release();
    return 0;
}

}  // namespace

// No exception may cross into C.
extern "C" int ropsim_module_write_rgb(const char *path, const char *format, uint32_t width, uint32_t height,
                                       bool is_float, const void *pixels, char *why, size_t why_size)
{
    try {
        return write_rgb(path, format, width, height, is_float, pixels, why, why_size);
    } catch (const std::exception &error) {
        return fail(why, why_size, error.what());
    }
}

extern "C" int ropsim_module_read_rgb(const char *path, const char *format, uint64_t pixels_max, uint32_t *width,
                                      uint32_t *height, float **rgb, char *why, size_t why_size)
{
    try {
        return read_rgb(path, format, pixels_max, width, height, rgb, why, why_size);
    } catch (const std::exception &error) {
        return fail(why, why_size, error.what());
    }
}

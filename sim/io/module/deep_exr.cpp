// Deep EXR through OpenImageIO. Goes in: lists of samples a pixel; comes out: the same, values untouched.
//
// Reading goes scanline by scanline so that a file that promises absurd counts is refused before its lists are copied.
#include "images.h"

#include <OpenImageIO/deepdata.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>

namespace
{

constexpr uint64_t pixels_max = uint64_t(1) << 30;
constexpr int side_max = 32768;

int fail(char *why, size_t why_size, const std::string &reason)
{
    std::snprintf(why, why_size, "%s", reason.empty() ? "unknown reason" : reason.c_str());
    return 1;
}

int write_deep(const char *path, const deep_image &image, char *why, size_t why_size)
{
    auto out = OIIO::ImageOutput::create("openexr");
    if (!out || !out->supports("deepdata"))
        return fail(why, why_size, OIIO::geterror());
    OIIO::ImageSpec spec(int(image.width), int(image.height), 5, OIIO::TypeDesc::FLOAT);
    spec.channelnames.clear();
    for (const char *name : {"R", "G", "B", "A", "Z"})
        spec.channelnames.emplace_back(name);
    spec.channelformats.assign(5, OIIO::TypeDesc::FLOAT);
    for (auto [name, values] : {std::pair("id", image.id), std::pair("sample", image.sample)})
        if (values) {
            spec.channelnames.push_back(name);
            spec.channelformats.push_back(OIIO::TypeDesc::UINT);
        }
    spec.nchannels = int(spec.channelnames.size());
    spec.alpha_channel = 3;
    spec.z_channel = 4;
    spec.deep = true;
    spec.attribute("compression", "zips");  // the only packing of deep data that is really done
    // Else the time of writing goes into the file, and no two runs give the same bytes.
    spec.attribute("DateTime", "2000:01:01 00:00:00");

    OIIO::DeepData data;
    int64_t pixels = int64_t(image.width) * image.height;
    data.init(pixels, spec.nchannels, spec.channelformats, spec.channelnames);
    data.set_all_samples(OIIO::cspan<unsigned int>(image.pixel_counts, pixels));
    uint64_t from = 0;
    for (int64_t p = 0; p < pixels; p++)
        for (uint32_t s = 0; s < image.pixel_counts[p]; s++, from++) {
            int channel = 0;
            for (const float *values : {image.rgba[0], image.rgba[1], image.rgba[2], image.rgba[3], image.depth})
                data.set_deep_value(p, channel++, int(s), values[from]);
            for (const uint32_t *values : {image.id, image.sample})
                if (values)
                    data.set_deep_value(p, channel++, int(s), values[from]);
        }
    if (!out->open(path, spec) || !out->write_deep_image(data) || !out->close())
        return fail(why, why_size, out->geterror());
    return 0;
}

// Where the channels that we know stand in the file; -1: nowhere.
struct channels {
    int rgba[4], depth, id, sample;
};

template <typename T> void grow(T *&values, uint64_t count)
{
    void *more = std::realloc(values, std::max<uint64_t>(count, 1) * sizeof(T));
    if (!more)
        throw std::bad_alloc();
    values = static_cast<T *>(more);
}

void make_room(deep_image &image, const channels &channels, uint64_t count)
{
    grow(image.depth, count);
    for (float *&values : image.rgba)
        grow(values, count);
    if (channels.id >= 0)
        grow(image.id, count);
    if (channels.sample >= 0)
        grow(image.sample, count);
}

void copy_row(deep_image &image, const channels &channels, const OIIO::DeepData &data)
{
    uint64_t to = image.count;
    for (int64_t p = 0; p < data.pixels(); p++)
        for (int s = 0; s < data.samples(p); s++, to++) {
            image.depth[to] = data.deep_value(p, channels.depth, s);
            for (int c = 0; c < 4; c++)
                image.rgba[c][to] = channels.rgba[c] >= 0 ? data.deep_value(p, channels.rgba[c], s) : 0;
            if (image.id)
                image.id[to] = data.deep_value_uint(p, channels.id, s);
            if (image.sample)
                image.sample[to] = data.deep_value_uint(p, channels.sample, s);
        }
    image.count = to;
}

// A UINT channel of that name, or -1: as floats, identifiers would come back normalised.
int uint_channel(const OIIO::ImageSpec &spec, const char *name)
{
    int channel = spec.channelindex(name);
    return channel >= 0 && spec.channelformat(channel) == OIIO::TypeDesc::UINT ? channel : -1;
}

int read_deep(const char *path, uint64_t count_max, deep_image &image, char *why, size_t why_size)
{
    auto in = OIIO::ImageInput::open(path);
    if (!in)
        return fail(why, why_size, OIIO::geterror());
    const OIIO::ImageSpec &spec = in->spec();
    channels channels = {
        {spec.channelindex("R"), spec.channelindex("G"), spec.channelindex("B"), spec.channelindex("A")},
        spec.channelindex("Z"),
        uint_channel(spec, "id"),
        uint_channel(spec, "sample")};
    if (!spec.deep || channels.depth < 0)
        return fail(why, why_size, "not a deep image with a channel Z");
    if (spec.width < 1 || spec.height < 1 || spec.width > side_max || spec.height > side_max ||
        uint64_t(spec.width) * uint64_t(spec.height) > pixels_max)
        return fail(why, why_size, "more pixels than this reader takes");
    image.width = uint32_t(spec.width);
    image.height = uint32_t(spec.height);
    image.has_color = channels.rgba[0] >= 0 && channels.rgba[1] >= 0 && channels.rgba[2] >= 0;
    image.has_alpha = channels.rgba[3] >= 0;
    image.has_back = spec.channelindex("ZBack") >= 0;
    grow(image.pixel_counts, uint64_t(image.width) * image.height);
    make_room(image, channels, 0);

    uint64_t room = 0, pixel = 0;
    int step = spec.tile_width ? spec.height : 1;  // a tiled file comes as a whole
    for (int y = 0; y < spec.height; y += step) {
        OIIO::DeepData data;
        bool read = spec.tile_width
                        ? in->read_native_deep_image(0, 0, data)
                        : in->read_native_deep_scanlines(0, 0, spec.y + y, spec.y + y + 1, 0, 0, spec.nchannels, data);
        if (!read)
            return fail(why, why_size, in->geterror());
        uint64_t more = 0;
        for (int64_t p = 0; p < data.pixels(); p++)
            more += image.pixel_counts[pixel++] = uint32_t(data.samples(p));
        if (more > count_max - image.count)
            return fail(why, why_size, "more samples than this reader takes");
        if (image.count + more > room)
            make_room(image, channels, room = std::min(count_max, std::max(2 * room, image.count + more)));
        copy_row(image, channels, data);
    }
    return 0;
}

}  // namespace

// No exception may cross into C.
extern "C" int ropsim_module_write_deep(const char *path, const deep_image *image, char *why, size_t why_size)
{
    try {
        return write_deep(path, *image, why, why_size);
    } catch (const std::exception &error) {
        return fail(why, why_size, error.what());
    }
}

extern "C" int ropsim_module_read_deep(const char *path, uint64_t count_max, deep_image *image, char *why,
                                       size_t why_size)
{
    try {
        return read_deep(path, count_max, *image, why, why_size);
    } catch (const std::exception &error) {
        return fail(why, why_size, error.what());
    }
}

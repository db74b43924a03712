// OpenMesh's file readers, without its meshes: an importer that keeps vertices and faces as they come.
//
// Reading into OpenMesh's own half-edge mesh would duplicate vertices of non-manifold faces without their
// attributes and drop faces. Here everything stays in the file's order. The readers are singletons with state,
// so one lock covers a whole read.
#include "mesh_reader.h"

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/BaseKernel.hh>

#include <strings.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

namespace
{

template <int n> using Rows = std::vector<std::array<float, n>>;

// The parts of BaseImporter that polygons need; the rest is ignored.
class SoupImporter final : public OpenMesh::IO::BaseImporter
{
  public:
    explicit SoupImporter(uint64_t limit) : limit_(limit) {}

    VertexHandle add_vertex(const OpenMesh::Vec3f &point) override
    {
        count(positions.size());
        positions.push_back({point[0], point[1], point[2]});
        return VertexHandle(int(positions.size()) - 1);
    }
    VertexHandle add_vertex() override
    {
        return add_vertex(OpenMesh::Vec3f(0, 0, 0));
    }
    void set_point(VertexHandle v, const OpenMesh::Vec3f &point) override
    {
        if (has(v.idx(), positions.size()))
            positions[size_t(v.idx())] = {point[0], point[1], point[2]};
    }

    FaceHandle add_face(const VHandles &handles) override
    {
        count(faces.size());
        faces.emplace_back();
        for (VertexHandle v : handles)
            add_corner(faces.back(), v.idx());
        return FaceHandle(int(faces.size()) - 1);
    }

    // OM files hold half-edges: faces are walked in finish().
    HalfedgeHandle add_edge(VertexHandle from, VertexHandle to) override
    {
        count(to_vertex.size());
        to_vertex.push_back(to.idx());
        to_vertex.push_back(from.idx());
        next.resize(to_vertex.size(), -1);
        return HalfedgeHandle(int(to_vertex.size()) - 2);
    }
    void set_next(HalfedgeHandle h, HalfedgeHandle following) override
    {
        if (has(h.idx(), next.size()))
            next[size_t(h.idx())] = following.idx();
    }
    FaceHandle add_face(HalfedgeHandle h) override
    {
        count(faces.size());
        faces.emplace_back();
        first_halfedge.resize(faces.size(), -1);
        first_halfedge.back() = h.idx();
        return FaceHandle(int(faces.size()) - 1);
    }
    void finish() override
    {
        for (size_t f = 0; f < first_halfedge.size(); f++) {
            int h = first_halfedge[f];
            do {
                if (!has(h, next.size()))
                    throw std::runtime_error("its half-edges do not form faces");
                add_corner(faces[f], to_vertex[size_t(h)]);
                h = next[size_t(h)];
            } while (h != first_halfedge[f]);
        }
        first_halfedge.clear();
    }

    void set_normal(VertexHandle v, const OpenMesh::Vec3f &n) override
    {
        set<3>(normals, v.idx(), positions.size(), {n[0], n[1], n[2]});
    }
    void set_normal(VertexHandle v, const OpenMesh::Vec3d &n) override
    {
        set_normal(v, OpenMesh::Vec3f(n));
    }
    void set_color(VertexHandle v, const OpenMesh::Vec4f &c) override
    {
        set<4>(vertex_colors, v.idx(), positions.size(), {c[0], c[1], c[2], c[3]});
    }
    void set_color(VertexHandle v, const OpenMesh::Vec3f &c) override
    {
        set_color(v, OpenMesh::Vec4f(c[0], c[1], c[2], 1));
    }
    void set_color(VertexHandle v, const OpenMesh::Vec4uc &c) override
    {
        set_color(v, from_bytes(c[0], c[1], c[2], c[3]));
    }
    void set_color(VertexHandle v, const OpenMesh::Vec3uc &c) override
    {
        set_color(v, from_bytes(c[0], c[1], c[2], 255));
    }
    void set_color(FaceHandle f, const OpenMesh::Vec4f &c) override
    {
        set<4>(face_colors, f.idx(), faces.size(), {c[0], c[1], c[2], c[3]});
    }
    void set_color(FaceHandle f, const OpenMesh::Vec3f &c) override
    {
        set_color(f, OpenMesh::Vec4f(c[0], c[1], c[2], 1));
    }
    void set_color(FaceHandle f, const OpenMesh::Vec4uc &c) override
    {
        set_color(f, from_bytes(c[0], c[1], c[2], c[3]));
    }
    void set_color(FaceHandle f, const OpenMesh::Vec3uc &c) override
    {
        set_color(f, from_bytes(c[0], c[1], c[2], 255));
    }

    void set_halfedge(VertexHandle, HalfedgeHandle) override {}
    void set_face(HalfedgeHandle, FaceHandle) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f> &) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f> &) override {}
    void set_face_texindex(FaceHandle, int) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec2f &) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f &) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec3f &) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f &) override {}
    void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void set_status(EdgeHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void request_face_texcoords2D() override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3uc &) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4uc &) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3f &) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4f &) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3f &) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3d &) override {}
    void add_texture_information(int, std::string) override {}

    // Readers look up named properties here; there are none.
    OpenMesh::BaseKernel *kernel() override
    {
        return &no_properties_;
    }
    size_t n_vertices() const override
    {
        return positions.size();
    }
    size_t n_faces() const override
    {
        return faces.size();
    }
    size_t n_edges() const override
    {
        return to_vertex.size() / 2;
    }

    Rows<3> positions, normals;
    Rows<4> vertex_colors, face_colors;
    std::vector<std::vector<int>> faces;
    std::vector<int> to_vertex, next, first_halfedge;
    uint64_t corner_count = 0;

  private:
    static bool has(int index, size_t size)
    {
        return index >= 0 && size_t(index) < size;
    }
    static OpenMesh::Vec4f from_bytes(int r, int g, int b, int a)
    {
        return OpenMesh::Vec4f(float(r), float(g), float(b), float(a)) / 255.0f;
    }
    void count(uint64_t so_far) const
    {
        if (so_far >= limit_)
            throw std::runtime_error("it says that it holds more than a file of its size can");
    }
    void add_corner(std::vector<int> &face, int vertex)
    {
        count(corner_count++);
        face.push_back(vertex);
    }
    template <int n> void set(Rows<n> &rows, int index, size_t size, const std::array<float, n> &row)
    {
        if (!has(index, size))
            return;
        rows.resize(size, {});
        rows[size_t(index)] = row;
    }

    uint64_t limit_;
    struct NoProperties : OpenMesh::BaseKernel {
    } no_properties_;
};

template <int n> float (*copy_rows(Rows<n> &rows, size_t size))[n]
{
    rows.resize(size, {});
    auto *copy = static_cast<float(*)[n]>(std::calloc(size ? size : 1, sizeof(float[n])));
    if (!copy)
        throw std::bad_alloc();
    if (size)
        std::memcpy(copy, rows.data(), size * sizeof(float[n]));
    return copy;
}

void hand_over(SoupImporter &importer, polygon_soup *soup)
{
    size_t vertices = importer.positions.size(), faces = importer.faces.size();
    soup->positions = copy_rows<3>(importer.positions, vertices);
    if (!importer.normals.empty())
        soup->normals = copy_rows<3>(importer.normals, vertices);
    if (!importer.vertex_colors.empty())
        soup->vertex_colors = copy_rows<4>(importer.vertex_colors, vertices);
    if (!importer.face_colors.empty())
        soup->face_colors = copy_rows<4>(importer.face_colors, faces);
    soup->corners = static_cast<uint32_t *>(std::calloc(importer.corner_count + 1, sizeof(uint32_t)));
    soup->face_ends = static_cast<uint64_t *>(std::calloc(faces + 1, sizeof(uint64_t)));
    if (!soup->corners || !soup->face_ends)
        throw std::bad_alloc();
    uint64_t corner = 0;
    for (size_t f = 0; f < faces; f++) {
        for (int vertex : importer.faces[f])
            soup->corners[corner++] = uint32_t(vertex);  // -1 becomes UINT32_MAX: out of range
        soup->face_ends[f] = corner;
    }
    soup->vertex_count = uint32_t(vertices);
    soup->face_count = uint32_t(faces);
}

}  // namespace

namespace
{

// OpenMesh's OFF reader takes comments for numbers, wants the counts on a line of their own, colours separated by
// single spaces, and knows colours of faces only in a file that says COFF. So it gets the file rewritten that way.
void rewrite_off(std::istream &in, std::ostream &out)
{
    bool headed = false;
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line.substr(0, line.find('#')));
        std::string word, row;
        while (words >> word) {
            if (!headed) {
                if (word.find('C') == std::string::npos)
                    word.insert(word.rfind("ST", 0) == 0 ? 2 : 0, "C");
                out << word << '\n';
                headed = true;
            } else {
                row += row.empty() ? word : ' ' + word;
            }
        }
        if (!row.empty())
            out << row << '\n';
    }
}

bool read_off(const char *path, SoupImporter &importer, OpenMesh::IO::Options &options)
{
    const char *folder = std::getenv("TMPDIR");
    std::string copy = std::string(folder && *folder ? folder : "/tmp") + "/ropsim-XXXXXX.off";
    int file = mkstemps(&copy[0], 4);
    if (file < 0)
        throw std::runtime_error("cannot write a temporary copy");
    close(file);
    struct Remover {
        const std::string &path;
        ~Remover()
        {
            unlink(path.c_str());
        }
    } remover{copy};
    {
        std::ifstream in(path);
        std::ofstream out(copy);
        rewrite_off(in, out);
        out.close();
        if (!out)
            throw std::runtime_error("cannot write a temporary copy");
    }
    return OpenMesh::IO::IOManager().read(copy, importer, options);
}

bool is_off(const char *path)
{
    const char *ending = std::strrchr(path, '.');
    return ending && strcasecmp(ending, ".off") == 0;
}

}  // namespace

bool mesh_read_polygons(const char *path, uint64_t limit, polygon_soup *soup, char *reason, size_t reason_size)
{
    static std::mutex one_reader;
    std::lock_guard<std::mutex> lock(one_reader);
    *soup = polygon_soup();
    try {
        omerr().disable();
        omlog().disable();
        omout().disable();
        using OpenMesh::IO::Options;
        Options options(Options::VertexNormal | Options::VertexColor | Options::FaceColor);
        SoupImporter importer(limit < 0x7fffffff ? limit : 0x7fffffff);
        if (!(is_off(path) ? read_off(path, importer, options)
                           : OpenMesh::IO::IOManager().read(std::string(path), importer, options))) {
            std::snprintf(reason, reason_size, "OpenMesh cannot read it");
            return false;
        }
        hand_over(importer, soup);
        return true;
    } catch (const std::bad_alloc &) {
        std::snprintf(reason, reason_size, "out of memory");
    } catch (const std::exception &failure) {
        std::snprintf(reason, reason_size, "%s", failure.what());
    }
    polygon_soup_clear(soup);
    return false;
}

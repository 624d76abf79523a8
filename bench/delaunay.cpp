// Delaunay tetrahedra of a point cloud, for the graded mesh of figures.py. A tool of its own on libtet
// (AGPL), compiled by figures.py where the library is installed; nothing of it is linked into tetralod.
//
//     delaunay POINTS TETS    POINTS: float32 x y z; TETS: int32 a b c d
#include <cstdint>
#include <cstdio>
#include <vector>

#include <tetgen.h>

static bool read_points(const char *path, std::vector<float> &points)
{
    FILE *file = std::fopen(path, "rb");
    if (!file) return false;
    float point[3];
    while (std::fread(point, sizeof point, 1, file) == 1) points.insert(points.end(), point, point + 3);
    std::fclose(file);
    return !points.empty();
}

int main(int argc, char **argv)
{
    std::vector<float> points;
    if (argc != 3 || !read_points(argv[1], points)) {
        std::fprintf(stderr, "usage: delaunay POINTS TETS\n");
        return 2;
    }
    tetgenio in, out;
    in.numberofpoints = static_cast<int>(points.size() / 3);
    in.pointlist = new REAL[points.size()];
    for (size_t i = 0; i < points.size(); i++) in.pointlist[i] = points[i];
    char switches[] = "zQ"; // indices from 0, no talk
    try {
        tetrahedralize(switches, &in, &out);
    } catch (int code) {
        std::fprintf(stderr, "delaunay: libtet ends with %d\n", code);
        return 1;
    }
    FILE *file = std::fopen(argv[2], "wb");
    if (!file) return 1;
    const size_t count = static_cast<size_t>(out.numberoftetrahedra);
    const bool whole = std::fwrite(out.tetrahedronlist, 4 * sizeof(int32_t), count, file) == count;
    return std::fclose(file) == 0 && whole ? 0 : 1;
}

/// Scene files whose shapes are in files of meshes.
#include "src/tool/scene_file.hpp"

#include <jfpx/error.hpp>
#include <jfpx/world.hpp>

#include "src/tool/mesh_file.hpp"
#include "src/tool/mesh_readers.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace jfpx {
namespace {

using test::TemporaryFolder;
using testing::HasSubstr;

void write(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

/// A square of two triangles in the plane y = 0, with the fronts upward.
constexpr const char* kObj = R"(# a square
o square
v -1 0 -1
v -1 0 1
v 1 0 1
v 1 0 -1
f 1 2 3 4
)";
constexpr const char* kPly = R"(ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
end_header
-1 0 -1
-1 0 1
1 0 1
1 0 -1
3 0 1 2
3 0 2 3
)";
constexpr const char* kStl = R"(solid square
facet normal 0 1 0
outer loop
vertex -1 0 -1
vertex -1 0 1
vertex 1 0 1
endloop
endfacet
facet normal 0 1 0
outer loop
vertex -1 0 -1
vertex 1 0 1
vertex 1 0 -1
endloop
endfacet
endsolid square
)";
/// A triangle (0, 0, 0), (0, 0, 1), (1, 0, 0), which its node moves by (-0.5, 2, 0).
constexpr const char* kGltf =
    R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"mesh": 0, "translation": [-0.5, 2, 0]}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
"accessors": [
{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 0, 1]},
{"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
"buffers": [{"byteLength": 42,
"uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAAAAAAAAAAIA/AACAPwAAAAAAAAAAAAABAAIA"}]})";

std::string scene_with(const std::string& shape, const std::string& more = R"("mass": 0)") {
  return R"({"jfpx_scene": 2, "bodies": [{)" + more + R"(, "shape": )" + shape + "}]}";
}

std::string complaint(const std::string& path) {
  try {
    tool::load_scene_file(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// The corners of all triangles, sorted.
std::vector<std::array<Real, 3>> corners(const TriangleMesh& mesh) {
  std::vector<std::array<Real, 3>> result;
  for (const Triangle& triangle : mesh.triangles()) {
    for (const std::uint32_t i : triangle) {
      const Vec3& v = mesh.vertices()[i];
      result.push_back({v.x, v.y, v.z});
    }
  }
  std::ranges::sort(result);
  return result;
}

TriangleMesh square_mesh() {
  return TriangleMesh({{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}}, {{0, 1, 2}, {0, 2, 3}});
}

/// A PLY file of the square with a value of some type in front of the coordinates.
template <class Count, class Index>
std::string binary_ply(bool big, const std::string& count, const std::string& index) {
  std::string text = std::string("ply\r\nformat binary_") + (big ? "big" : "little") +
                     "_endian 1.0\r\ncomment a square\r\nelement vertex 4\r\n"
                     "property uchar red\r\nproperty double x\r\nproperty float y\r\n"
                     "property short z\r\nelement face 1\r\nproperty list " +
                     count + " " + index + " vertex_index\r\nend_header\r\n";
  const auto put = [&](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    if (big) std::ranges::reverse(bytes);
    text += bytes;
  };
  for (const int i : {0, 1, 2, 3}) {
    put(std::uint8_t{200});
    put(i < 2 ? -1.0 : 1.0);
    put(0.0f);
    put(static_cast<std::int16_t>(i == 1 || i == 2 ? 1 : -1));
  }
  put(Count{4});
  for (const int i : {0, 1, 2, 3}) put(static_cast<Index>(i));
  return text;
}

TEST(SceneFile, ReadsTextAndBinaryPly) {
  const TemporaryFolder folder;
  for (const std::string& content :
       {std::string(kPly), binary_ply<std::uint8_t, std::int32_t>(false, "uchar", "int"),
        binary_ply<std::uint8_t, std::uint32_t>(true, "uint8", "uint32"),
        binary_ply<std::int32_t, std::uint16_t>(false, "int", "ushort"),
        binary_ply<std::int16_t, std::int8_t>(true, "int16", "char")}) {
    write(folder.file("square.PLY"), content);
    const TriangleMesh mesh(tool::read_mesh_file(folder.file("square.PLY")));
    EXPECT_EQ(corners(mesh), corners(square_mesh()));
    EXPECT_EQ(mesh.report().open_edges, 4u);
  }
}

/// Every cut file, and files with one changed byte: an error, or a mesh.
TEST(SceneFile, DamagedPlyFilesAreErrorsOrMeshes) {
  int errors = 0, meshes = 0;
  for (const std::string& whole :
       {std::string(kPly), binary_ply<std::uint8_t, std::int32_t>(false, "uchar", "int")}) {
    for (std::size_t n = 0; n < 3 * whole.size(); ++n) {
      std::string damaged = whole.substr(0, n);
      if (n >= whole.size()) {
        damaged = whole;
        damaged[n % whole.size()] = static_cast<char>(n * 7919);
      }
      try {
        const TriangleMesh mesh(tool::read_ply("damaged.ply", damaged));
        ++meshes;
      } catch (const Error&) {
        ++errors;
      }
    }
  }
  EXPECT_GT(errors, 500);
  EXPECT_GT(meshes, 20);
}

TEST(SceneFile, FaultsOfPlyFilesAreNamed) {
  const auto fault = [](const std::string& content) -> std::string {
    try {
      tool::read_ply("a.ply", content);
    } catch (const FileError& error) {
      return error.what();
    }
    return "no error";
  };
  const std::string head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  EXPECT_THAT(fault("solid\n"), HasSubstr("a.ply: the file is no PLY file"));
  EXPECT_THAT(fault(head), HasSubstr("a.ply: the header of the PLY file has no end"));
  EXPECT_THAT(fault("ply\nend_header\n"), HasSubstr("has no format"));
  EXPECT_THAT(fault("ply\nformat utf 1.0\n"), HasSubstr("unknown format utf"));
  EXPECT_THAT(fault("ply\nformat ascii 1.0\nproperty float x\n"), HasSubstr("has no element"));
  EXPECT_THAT(fault(head + "property half y\n"), HasSubstr("the unknown type half"));
  EXPECT_THAT(fault(head + "element face many\n"), HasSubstr("has no count"));
  EXPECT_THAT(fault(head + faces), HasSubstr("a.ply: the PLY file ends too early"));
  EXPECT_THAT(fault(head + faces + "zero\n"), HasSubstr("has \"zero\" instead of a number"));
  EXPECT_THAT(fault(head + faces + "0\n3 0 1 0\n"), HasSubstr("a face has the vertex 1 of 1"));
  EXPECT_THAT(fault(head + faces + "0\n3 0 -1 0\n"), HasSubstr("index out of range"));
  EXPECT_THAT(fault("ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\n"
                    "end_header\n1\n"),
              HasSubstr("ends too early"));
}

#if JFPX_HAS_ASSIMP

TEST(SceneFile, ReadsMeshesOfAllFormats) {
  const TemporaryFolder folder;
  write(folder.file("square.obj"), kObj);
  write(folder.file("square.stl"), kStl);
  write(folder.file("triangle.gltf"), kGltf);
  for (const char* name : {"square.obj", "square.stl"}) {
    const TriangleMesh mesh(tool::read_mesh_file(folder.file(name)));
    EXPECT_EQ(corners(mesh), corners(square_mesh())) << name;
    EXPECT_EQ(mesh.report().open_edges, 4u) << name;
  }
  const TriangleMesh moved({{Real(-0.5), 2, 0}, {Real(-0.5), 2, 1}, {Real(0.5), 2, 0}},
                           {{0, 1, 2}});
  EXPECT_EQ(corners(TriangleMesh(tool::read_mesh_file(folder.file("triangle.gltf")))),
            corners(moved));
}

TEST(SceneFile, NamesFilesRelativeToItsFolder) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("meshes"));
  write(folder.file("meshes/square.obj"), kObj);
  const std::string mesh =
      R"({"type": "triangle_mesh", "file": "meshes/square.obj", "scale": 3, "two_sided": true})";
  write(folder.file("scene.json"),
        R"({"jfpx_scene": 2, "bodies": [{"mass": 0, "shape": )" + mesh +
            R"(}, {"position": [0, 2, 0.3], "shape": {"type": "sphere", "radius": 0.5}},)"
            R"({"mass": 0, "position": [9, 0, 0], "shape": )" +
            mesh + "}]}");
  const Scene scene = tool::load_scene_file(folder.file("scene.json"));
  const auto& first = std::get<TriangleMesh>(scene.bodies[0].shape);
  EXPECT_EQ(first.data(), std::get<TriangleMesh>(scene.bodies[2].shape).data());
  EXPECT_TRUE(first.two_sided());
  EXPECT_EQ(corners(first).front(), (std::array<Real, 3>{-3, 0, -3}));
  EXPECT_EQ(from_json(to_json(scene)), scene);  // with the mesh in the scene
  World world(scene);
  for (int n = 0; n < 120; ++n) world.step();
  EXPECT_NEAR(world.state(world.bodies()[1]).position.y, 0.5, 0.001);
}

TEST(SceneFile, AHullIsThatOfAllVertices) {
  const TemporaryFolder folder;
  write(folder.file("tetrahedron.obj"),
        "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  write(folder.file("scene.json"),
        scene_with(R"({"type": "hull", "file": "tetrahedron.obj", "scale": 0.5})", R"("mass": 2)"));
  const Scene scene = tool::load_scene_file(folder.file("scene.json"));
  const auto& hull = std::get<Hull>(scene.bodies[0].shape);
  EXPECT_EQ(hull.vertices().size(), 4u);
  EXPECT_NEAR(hull.volume(), 8.0 / 6, 1e-5);
  write(folder.file("flat.json"), scene_with(R"({"type": "hull", "file": "flat.obj"})"));
  write(folder.file("flat.obj"), kObj);
  EXPECT_THAT(complaint(folder.file("flat.json")), HasSubstr("body 0.shape.file: flat.obj: "));
}

TEST(SceneFile, AFileOfAMeshIsASceneOfIt) {
  const TemporaryFolder folder;
  write(folder.file("square.obj"), kObj);
  const Scene scene = tool::load_scene_file(folder.file("square.obj"));
  EXPECT_EQ(scene.name, "square");
  ASSERT_EQ(scene.bodies.size(), 1u);
  EXPECT_EQ(std::get<TriangleMesh>(scene.bodies[0].shape).triangles().size(), 2u);
}

TEST(SceneFile, FaultsOfMeshFilesAreNamed) {
  const TemporaryFolder folder;
  const auto fault = [&](const char* name, const std::string& content) {
    write(folder.file(name), content);
    return complaint(folder.file(name));
  };
  EXPECT_THAT(complaint(folder.file("none.obj")), HasSubstr("none.obj: Unable to open file"));
  EXPECT_THAT(fault("empty.obj", ""), HasSubstr("empty.obj: "));
  EXPECT_THAT(fault("other.stl", "no STL"), HasSubstr("other.stl: "));
  EXPECT_THAT(fault("cut.gltf", std::string(kGltf).substr(0, 300)), HasSubstr("cut.gltf: "));
  EXPECT_THAT(fault("points.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\n"), HasSubstr("points.obj: "));
  EXPECT_THAT(fault("far.obj", "v 0 0 0\nv 1e12 0 0\nv 0 0 1\nf 1 2 3\n"),
              HasSubstr("far.obj: vertices["));
  write(folder.file("scene.json"), scene_with(R"({"type": "triangle_mesh", "file": "mesh.step"})"));
  EXPECT_THAT(complaint(folder.file("scene.json")),
              HasSubstr("mesh.step: the name of a file of a mesh ends with .obj"));
}

#else

TEST(SceneFile, WithoutAssimpTheErrorNamesIt) {
  const TemporaryFolder folder;
  write(folder.file("square.obj"), kObj);
  write(folder.file("scene.json"),
        scene_with(R"({"type": "triangle_mesh", "file": "square.obj"})"));
  for (const char* name : {"square.obj", "scene.json"}) {
    EXPECT_THAT(complaint(folder.file(name)),
                HasSubstr("square.obj: this program is built without assimp"));
  }
}

#endif

TEST(SceneFile, FaultsOfShapesInFilesAreNamed) {
  const TemporaryFolder folder;
  const auto fault = [&](const std::string& shape) {
    write(folder.file("scene.json"), scene_with(shape));
    return complaint(folder.file("scene.json"));
  };
  EXPECT_THAT(
      fault(R"({"type": "box", "file": "a.obj"})"),
      HasSubstr("scene.json: body 0.shape.file: only shapes of type triangle_mesh or hull"));
  EXPECT_THAT(fault(R"({"type": "hull", "file": 3})"), HasSubstr("shape.file: must be a string"));
  for (const char* scale : {"0", "-1", "1e10", "\"a\""}) {
    EXPECT_THAT(fault(R"({"type": "hull", "file": "a.obj", "scale": )" + std::string(scale) + "}"),
                HasSubstr("body 0.shape.scale: must be a number > 0"));
  }
  EXPECT_THAT(fault(R"({"type": "hull", "file": "a.obj", "two_sided": true})"),
              HasSubstr("body 0.shape: has an unknown field \"two_sided\""));
  EXPECT_THAT(fault(R"({"type": "triangle_mesh", "file": "a.obj", "vertices": []})"),
              HasSubstr("known fields of a shape in a file are file, scale, two_sided, type"));
  EXPECT_THAT(fault(R"({"type": "triangle_mesh"})"), HasSubstr("has no field \"vertices\""));
  write(folder.file("broken.json"), "[1, 2");
  EXPECT_THAT(complaint(folder.file("broken.json")), HasSubstr("broken.json: broken JSON"));
  write(folder.file("list.json"), "[1, 2]");
  EXPECT_THAT(complaint(folder.file("list.json")), HasSubstr("list.json: "));
}

}  // namespace
}  // namespace jfpx

// SPDX-License-Identifier: MIT
#include "scenes/foreign_mesh.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <limits>

#include "scenes/half_edge.h"
#include "test/scenes/measure.h"

namespace minescan {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// A folder that is gone at the end.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / unique_name()) {
    std::filesystem::create_directory(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::ofstream(path_ / name, std::ios::binary) << content;
    return path_ / name;
  }

 private:
  static std::string unique_name() {
    static int made = 0;
    return "minescan-foreign-" + std::to_string(getpid()) + "-" + std::to_string(++made);
  }
  std::filesystem::path path_;
};

ForeignMesh read(const std::string& name, const std::string& content) {
  const Folder folder;
  return read_foreign_mesh(folder.write(name, content));
}

/// Reading throws, names the file and says `what`; nothing is printed.
void expect_refused(const std::string& name, const std::string& content, const std::string& what) {
  const Folder folder;
  const std::filesystem::path path = folder.write(name, content);
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  std::string message;
  try {
    read_foreign_mesh(path);
    message = "read";
  } catch (const std::runtime_error& e) {
    message = e.what();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_TRUE(message.starts_with(path.string() + ":")) << message;
  EXPECT_NE(message.find(what), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

void expect_vertices(const ForeignMesh& mesh, const std::vector<Eigen::Vector3f>& vertices) {
  EXPECT_TRUE(same_bytes(mesh.vertices, vertices));
}

template <class T>
void put(std::string& bytes, T value, bool big_endian = false) {
  std::array<char, sizeof(T)> raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big_endian) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

const std::string ply_start = "ply\nformat ascii 1.0\n";
const std::string ply_vertices = "property float x\nproperty float y\nproperty float z\n";
const std::string ply_faces = "property list uchar int vertex_indices\n";
const std::string square = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

/// A text file of the square's vertices and the given faces.
std::string ply(int faces, const std::string& indices, int vertices = 4) {
  return ply_start + "element vertex " + std::to_string(vertices) + "\n" + ply_vertices +
         "element face " + std::to_string(faces) + "\n" + ply_faces + "end_header\n" + square +
         indices;
}

/// With triangles (i, i, i), (i + 1, 0, 0), (0, i + 1, 0).
std::string binary_stl(std::uint32_t stated, std::uint32_t present) {
  std::string bytes = "solid in binary, as some programs write";
  bytes.resize(80, ' ');
  put(bytes, stated);
  for (std::uint32_t i = 0; i < present; ++i) {
    const float a = static_cast<float>(i);
    for (const float value : {0.0F, 0.0F, 1.0F, a, a, a, a + 1, 0.0F, 0.0F, 0.0F, a + 1, 0.0F})
      put(bytes, value);
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string facet(const std::string& a, const std::string& b, const std::string& c) {
  return "facet normal 0 0 1\n outer loop\n  vertex " + a + "\n  vertex " + b + "\n  vertex " + c +
         "\n endloop\nendfacet\n";
}

TEST(ForeignMesh, IsWhatWriteMeshWrote) {
  const TriangleMesh mesh{
      .vertices = {{0, 0, 0}, {1.0F / 3, 0, 1e-7F}, {0, -12.3456789F, 0}, {0.1F, 0, 1.1F}},
      .triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
  const Folder folder;
  for (const std::string name : {"a.ply", "a.stl", "a.obj"}) {
    write_mesh(mesh, folder.path() / name);
    const ForeignMesh read = read_foreign_mesh(folder.path() / name);
    EXPECT_EQ(read.vertices.size(), 4U) << name;
    ASSERT_EQ(read.triangles.size(), 4U) << name;
    EXPECT_EQ(read.groups, std::vector<std::string>{""}) << name;
    EXPECT_EQ(read.group, std::vector<std::uint32_t>(4, 0)) << name;
    // The same corners in the same order, perhaps begun at another one.
    for (std::size_t t = 0; t < 4; ++t) {
      bool same = false;
      for (std::size_t first = 0; first < 3; ++first) {
        bool all = true;
        for (std::size_t k = 0; k < 3; ++k)
          all = all && read.vertices[read.triangles[t][(first + k) % 3]] ==
                           mesh.vertices[mesh.triangles[t][k]];
        same = same || all;
      }
      EXPECT_TRUE(same) << name << " triangle " << t;
    }
  }
}

TEST(ForeignMesh, KeepsWhatIsNoManifold) {
  // Three triangles on one side, one of them twice.
  const Triangles fan = {{0, 1, 2}, {0, 1, 3}, {1, 0, 2}, {0, 1, 2}};
  EXPECT_EQ(read("a.ply", ply(4, "3 0 1 2 3 0 1 3\n3 1 0 2\n3 0 1 2\n")).triangles, fan);
  EXPECT_EQ(
      read("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\nf 2 1 3\nf 1 2 3\n")
          .triangles,
      fan);
  const std::string a = "0 0 0", b = "1 0 0", c = "1 1 0", d = "0 1 0";
  EXPECT_EQ(read("a.stl", "solid\n" + facet(a, b, c) + facet(a, b, d) + facet(b, a, c) +
                              facet(a, b, c) + "endsolid\n")
                .triangles,
            fan);
}

TEST(ForeignMesh, HasPolygonsCutFromTheirFirstCorner) {
  const Triangles expected = {{3, 0, 1}, {3, 1, 2}, {0, 1, 2}};
  EXPECT_EQ(read("a.ply", ply(2, "4 3 0 1 2\n3 0 1 2\n")).triangles, expected);
  EXPECT_EQ(read("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 4 1 2 3\nf 1 2 3\n").triangles,
            expected);
}

TEST(ForeignMesh, IsTheSameFromBinaryPlyOfBothByteOrders) {
  for (const bool big : {false, true}) {
    std::string bytes = std::string("ply\r\nformat binary_") + (big ? "big" : "little") +
                        "_endian 1.0\r\ncomment x\r\nelement vertex 3\r\nproperty double x\r\n"
                        "property float y\r\nproperty double z\r\nelement face 1\r\n"
                        "property list ushort uchar vertex_index\r\nend_header\r\n";
    for (int i = 0; i < 3; ++i) {
      put(bytes, 0.5 + i, big);
      put(bytes, -0.25F * static_cast<float>(i * i), big);
      put(bytes, 1e-3, big);
    }
    put(bytes, std::uint16_t{3}, big);
    for (const char corner : {'\2', '\0', '\1'}) put(bytes, corner, big);
    const ForeignMesh mesh = read("a.PLY", bytes);
    expect_vertices(mesh, {{0.5F, -0.0F, 1e-3F}, {1.5F, -0.25F, 1e-3F}, {2.5F, -1, 1e-3F}});
    EXPECT_EQ(mesh.triangles, (Triangles{{2, 0, 1}}));
  }
}

// Each property that is not asked for takes another place; one misread would shift what follows.
TEST(ForeignMesh, OfPlyIsFoundAmongOtherElementsAndProperties) {
  const std::vector<std::string> types = {"char", "uchar", "int16", "ushort",
                                          "int",  "uint",  "float", "double"};
  for (const std::string format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    std::string header = "ply\nformat " + format + " 1.0\nobj_info of a program\n", body;
    const auto value = [&](const std::string& type, double v) {
      const bool big = format == "binary_big_endian";
      if (format == "ascii") {
        body += std::to_string(static_cast<int>(v)) + "\n";
      } else if (type == "char" || type == "uchar") {
        put(body, static_cast<char>(v));
      } else if (type == "int16" || type == "ushort") {
        put(body, static_cast<std::int16_t>(v), big);
      } else if (type == "int" || type == "uint") {
        put(body, static_cast<std::int32_t>(v), big);
      } else if (type == "float") {
        put(body, static_cast<float>(v), big);
      } else {
        put(body, v, big);
      }
    };
    const auto property = [&](const std::string& text) { header += "property " + text + "\n"; };
    header += "element strips 2\n";
    for (const std::string& type : types) property("list uint " + type + " of_" + type);
    for (int i = 0; i < 2; ++i)
      for (const std::string& type : types) {
        value("uint", 2);
        value(type, 7);
        value(type, 8);
      }
    header += "element vertex 4\n";
    property("float z");
    for (const std::string& type : types) property(type + " of_" + type);
    property("uchar red");
    property("float x");
    property("list uchar double weights");
    property("uchar nx");
    property("double y");
    for (int i = 0; i < 4; ++i) {
      value("float", i);
      for (const std::string& type : types) value(type, 9);
      value("uchar", 200);
      value("float", i * i);
      value("uchar", i);
      for (int k = 0; k < i; ++k) value("double", 3);
      value("uchar", 1);
      value("double", -i);
    }
    header += "element nothing 7\nelement face 2\n";
    property("uchar flags");
    property("list char float texcoord");
    property("list short int16 vertex_indices");
    property("list int uint more");
    property("float quality");
    for (int i = 0; i < 2; ++i) {
      value("uchar", 5);
      value("char", 1);
      value("float", 6);
      value("int16", 3);
      for (int k = 0; k < 3; ++k) value("int16", k + i);
      value("int", 1);
      value("uint", 6);
      value("float", 1);
    }
    header += "element edge 1\nproperty int vertex1\n";
    value("int", 4);
    ::testing::internal::CaptureStderr();
    const ForeignMesh mesh = read("a.ply", header + "end_header\n" + body);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    expect_vertices(mesh, {{0, 0, 0}, {1, -1, 1}, {4, -2, 2}, {9, -3, 3}});
    EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {1, 2, 3}})) << format;
  }
}

TEST(ForeignMesh, OfPlyMayHaveItsFacesFirst) {
  const ForeignMesh mesh =
      read("a.ply", ply_start + "element face 1\n" + ply_faces + "element vertex 3\n" +
                        ply_vertices + "end_header\n3 0 1 2\n0 0 0 +1.5 0 0 0 1e-60 .5");
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
  expect_vertices(mesh, {{0, 0, 0}, {1.5F, 0, 0}, {0, 0, 0.5F}});
}

TEST(ForeignMesh, OfStlHasEqualVerticesMergedInTheOrderTheyComeIn) {
  const ForeignMesh text =
      read("a.STL", "solid endsolid vertex facet\r\n" + facet("0 0 0", "1 0 0", "0 1 0") +
                        "\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX\t1e0 -0 0\n vertex 1 1 0 \n"
                        "vertex 0 1.0 0\nEndLoop\nendfacet\nendsolid\n\nsolid two\n" +
                        facet("5 5 5", "1 1 0", "1 1 0.0000001") + "endsolid two\n");
  expect_vertices(text,
                  {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {5, 5, 5}, {1, 1, 0.0000001F}});
  EXPECT_EQ(text.triangles, (Triangles{{0, 1, 2}, {1, 3, 2}, {4, 3, 5}}));

  const ForeignMesh binary = read("a.stl", binary_stl(2, 2));
  expect_vertices(binary, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}, {2, 0, 0}, {0, 2, 0}});
  EXPECT_EQ(binary.triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
}

TEST(ForeignMesh, OfObjIsGroupedByMaterialElseByGroupOrObject) {
  const ForeignMesh mesh =
      read("a.obj",
           "# text\nmtllib not there.mtl\nv 0 0 0 1.0\nv 1 0 0 0.1 0.2 0.3\n"
           "v 1 1 0\nvt 0 0\nvn 0 0 1\nf 1 2 3\no thing\nf 1/1 2/1 3/1\n"
           "g left side\nf 1/1/1 2/1/1 3/1/1\nusemtl rock \nf 1//1 2//1 3//1\n"
           "v 0 1 0\nf -4 -3 -2 -1\ng right\nusemtl wood\r\nf 1 2 4\nusemtl rock\n"
           "s off\nf 4 3 2");
  EXPECT_EQ(mesh.vertices.size(), 4U);
  EXPECT_EQ(mesh.groups, (std::vector<std::string>{"", "thing", "left side", "rock", "wood"}));
  EXPECT_EQ(mesh.group, (std::vector<std::uint32_t>{0, 1, 2, 3, 3, 3, 4, 3}));
  EXPECT_EQ(
      mesh.triangles,
      (Triangles{
          {0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {3, 2, 1}}));
}

TEST(ForeignMesh, PrintsNothing) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  read("a.obj", "mtllib none.mtl\nusemtl x\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
  read("a.ply", ply(2, "3 0 1 2\n3 0 0 0\n"));
  read("a.stl", "solid\n" + facet("0 0 0", "1 0 0", "0 1 0") + "endsolid");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(ForeignMesh, OfAnUnknownEndIsRefused) {
  for (const std::string name : {"a.off", "a", "a.ply.gz"})
    EXPECT_THROW(read(name, ply(1, "3 0 1 2\n")), std::invalid_argument) << name;
}

TEST(ForeignMesh, ThatIsNotThereOrAFolderOrEmptyIsRefused) {
  const Folder folder;
  for (const std::string end : {".ply", ".stl", ".obj"}) {
    std::filesystem::create_directory(folder.path() / ("b" + end));
    for (const std::string name : {"a", "b"}) {
      try {
        read_foreign_mesh(folder.path() / (name + end));
        FAIL() << name;
      } catch (const std::runtime_error& e) {
        EXPECT_TRUE(std::string(e.what()).starts_with((folder.path() / (name + end)).string()))
            << e.what();
      }
    }
    expect_refused("a" + end, "", "is empty");
    expect_refused("a" + end, "\n", "");
    expect_refused("a" + end, "This is a letter.\nIt says nothing about vertices.\n", "");
    expect_refused("a" + end, std::string("\0\1\2\xff\xfe", 5), "");
    std::string noise;
    for (unsigned i = 1; i < 3000; ++i) noise += static_cast<char>(i * 2654435761U >> 13 & 255U);
    expect_refused("a" + end, noise, "");
  }
}

TEST(ForeignMesh, OfBrokenPlyIsRefused) {
  expect_refused("a.ply", ply(1, "3 0 1 2\n", 2000000000), "vertex 5: the file ends here");
  for (const std::string format : {"ascii", "binary_little_endian"})
    for (const std::string count : {"4000000000", "18446744073709551615"}) {
      const std::string start = "ply\nformat " + format + " 1.0\nelement vertex " + count + "\n" +
                                ply_vertices + "element face " + count + "\n" + ply_faces;
      expect_refused("a.ply", start + "end_header\n" + square, "the file ends here");
    }
  expect_refused("a.ply", ply(1, "4000000000 0 1 2\n"), "face 0: the file ends here");
  expect_refused("a.ply", ply(1, "-3 0 1 2\n"), "length of a list");
  expect_refused("a.ply", ply(1, "3 0 1\n"), "face 0: the file ends here");
  expect_refused("a.ply", ply(2, "3 0 1 2\n"), "face 1: the file ends here; expected 2");
  expect_refused("a.ply", ply(1, "2 0 1\n"), "3 corners or more");
  expect_refused("a.ply", ply(2, "3 0 1 2\n3 0 1 4\n"), "triangle 1: expected vertices below 4");
  expect_refused("a.ply", ply(1, "3 0 1 -1\n"), "found -1");
  expect_refused("a.ply", ply(1, "3 0 1 2.5\n"), "face 0: expected a whole number, found '2.5'");
  expect_refused("a.ply", ply(1, "3 0 1 two\n"), "found 'two'");
  expect_refused("a.ply", ply(0, ""), "holds no triangles");
  expect_refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 4\n" + ply_vertices, "header");
  expect_refused("a.ply", "ply\nend_header\n", "a.ply:2: expected the format");
  expect_refused("a.ply", "ply\nformat text 1.0\nend_header\n", "a.ply:2: expected format ascii");
  expect_refused("a.ply", ply_start + "end_header\n", "holds no triangles");
  expect_refused("a.ply", ply_start + "element vertex many\nend_header\n", "'element vertex many'");
  expect_refused("a.ply", ply_start + "property float x\nend_header\n", "an element first");
  expect_refused("a.ply", ply_start + "element vertex 1\nproperty long x\nend_header\n",
                 "a.ply:4: expected property TYPE NAME");
  expect_refused("a.ply", ply_start + "element vertex 1\nproperty float x\nend_header\n0\n",
                 "x, y and z");
  expect_refused("a.ply",
                 ply_start + "element vertex 1\n" + ply_vertices +
                     "element face 1\nproperty int a\nend_header\n0 0 0\n1\n",
                 "vertex_indices");
  for (const std::string odd : {"nan", "inf", "1e39", "zero", "0x10", "1,5"})
    expect_refused("a.ply",
                   ply_start + "element vertex 3\n" + ply_vertices + "element face 1\n" +
                       ply_faces + "end_header\n0 0 0\n1 " + odd + " 0\n0 1 0\n3 0 1 2\n",
                   "vertex 1: expected a number, found '" + odd + "'");
  for (const float odd :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n" + ply_vertices +
                        "element face 1\n" + ply_faces + "end_header\n";
    for (const float v : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, odd}) put(bytes, v);
    put(bytes, '\3');
    for (const int corner : {0, 1, 2}) put(bytes, corner);
    expect_refused("a.ply", bytes, "vertex 2: expected finite coordinates");
    // Wherever it is cut.
    for (std::size_t size = 0; size < bytes.size(); ++size)
      expect_refused("a.ply", bytes.substr(0, size), "");
  }
  // A double that no float can hold.
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double "
      "y\nproperty double z\nelement face 1\n" +
      ply_faces + "end_header\n";
  for (const double v : {0.0, 0.0, 0.0, 1e300, 0.0, 0.0, 0.0, 1.0, 0.0}) put(bytes, v);
  put(bytes, '\3');
  for (const int corner : {0, 1, 2}) put(bytes, corner);
  expect_refused("a.ply", bytes, "vertex 1: expected finite coordinates");
}

TEST(ForeignMesh, OfBrokenStlIsRefused) {
  expect_refused("a.stl", binary_stl(0, 0), "holds no triangles");
  expect_refused("a.stl", binary_stl(3, 2).substr(1), "");
  // Such a file begins as a text does, so it is the text that is missed.
  expect_refused("a.stl", binary_stl(4000000000U, 2), "a.stl:");
  for (const std::uint32_t stated : {0U, 1U, 3U, 4000000000U}) {
    std::string bytes = binary_stl(stated, 2);
    bytes.replace(0, 5, "SolId");
    expect_refused("a.stl", bytes, "bytes for as many triangles as it says, found 184");
  }
  for (std::size_t size = 1; size < 184; ++size)
    expect_refused("a.stl", std::string("x").append(binary_stl(2, 2), 1, size - 1), "");
  for (const float odd :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::string bytes = binary_stl(2, 2);
    std::string value;
    put(value, odd);
    bytes.replace(84 + 50 + 12 + 4, 4, value);
    expect_refused("a.stl", bytes, "triangle 1: expected finite coordinates");
  }

  const std::string good =
      "solid\n" + facet("0 0 0", "1 0 0", "0 1 0") + facet("0 0 1", "1 0 0", "0 1 0") + "endsolid";
  EXPECT_EQ(read("a.stl", good).triangles.size(), 2U);
  for (std::size_t size = 0; size < good.size(); ++size)
    expect_refused("a.stl", good.substr(0, size), "");
  expect_refused("a.stl", "solid\nendsolid\n", "holds no triangles");
  expect_refused("a.stl", "solid\n" + facet("0 0 0", "1 0 0", "0 nan 0") + "endsolid\n",
                 "a.stl:6: expected 3 coordinates, found 'vertex 0 nan 0'");
  expect_refused("a.stl", "solid\n" + facet("0 0 0", "1 0", "0 1 0") + "endsolid\n", "a.stl:5:");
  expect_refused("a.stl", "solid\n" + facet("0 0 0", "1 0 0", "0 1 0\nvertex 2 2 2") + "endsolid\n",
                 "a.stl:7: expected 'endloop'");
  expect_refused("a.stl", "solid\n" + facet("0 0 0", "1 0 0", "0 1 0"), "'endsolid'");
}

TEST(ForeignMesh, OfBrokenObjIsRefused) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
  EXPECT_EQ(read("a.obj", vertices + "f 1 2 3").triangles.size(), 1U);
  expect_refused("a.obj", vertices, "holds no triangles");
  expect_refused("a.obj", vertices + "f 1 2 4\n", "expected vertices below 3, found 3");
  expect_refused("a.obj", vertices + "f 1 2 -4\n", "found -1");
  expect_refused("a.obj", vertices + "f 1 2 0\n", "a.obj:4: expected numbers of vertices");
  expect_refused("a.obj", vertices + "f 1 2 99999999999\n", "a.obj:4: expected numbers");
  expect_refused("a.obj", vertices + "f 1 2 x\n", "a.obj:4: expected numbers of vertices");
  expect_refused("a.obj", vertices + "f 1 2\n", "a.obj:4: expected 3 corners or more");
  expect_refused("a.obj", vertices + "f\n", "a.obj:4: expected 3 corners or more");
  expect_refused("a.obj", "v 0 0 0\nv 1 0\nv 1 1 0\nf 1 2 3\n", "a.obj:2: expected 3 coordinates");
  for (const std::string odd : {"nan", "inf", "1e39", "zero", "1,5"})
    expect_refused("a.obj", "v 0 0 0\nv 1 0 " + odd + "\nv 1 1 0\nf 1 2 3\n",
                   "a.obj:2: expected 3 coordinates, found 'v 1 0 " + odd + "'");
}

}  // namespace
}  // namespace minescan

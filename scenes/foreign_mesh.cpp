// SPDX-License-Identifier: MIT
#include "scenes/foreign_mesh.h"

#include <tiny_obj_loader.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "core/input_file.h"
#include "core/text.h"

// OpenMesh believes a file: of one that ends early it makes up the rest, a polygon of 4e9 corners
// it allocates, and properties it does not know shift everything behind them. tinyobjloader takes
// what is no number for 0. So files are walked through first. Of .ply and text .stl files that also
// leaves a plain copy, with nothing in it but what OpenMesh reads right.

namespace minescan {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
  throw std::runtime_error(path.string() + ": " + what);
}

[[noreturn]] void fail_at(const std::filesystem::path& path, std::size_t line,
                          const std::string& what) {
  throw std::runtime_error(path.string() + ":" + std::to_string(line) + ": " + what);
}

std::string quoted(std::string_view text) {
  std::string result("'");
  return result.append(text.substr(0, 40)).append("'");
}

std::string content_of(const std::filesystem::path& path) {
  std::string content = read_file(path);
  if (content.empty()) fail(path, "is empty");
  return content;
}

constexpr std::string_view blanks = " \t\r\n\v\f";

/// Takes the first word off `text`; empty if there is none.
std::string_view take_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  const std::size_t end = std::min(text.find_first_of(blanks), text.size());
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end);
  return word;
}

/// Takes the first line off `text`, without its end.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

template <class T>
std::optional<T> number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  // Too small for a double: 0 to all readers.
  if (std::is_floating_point_v<T> && error == std::errc::result_out_of_range &&
      word.find("e-") != std::string_view::npos)
    return T{};
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

bool is_coordinate(std::string_view word) {
  const std::optional<double> value = number<double>(word);
  return value && std::abs(*value) <= std::numeric_limits<float>::max();
}

/// OpenMesh's readers keep their state in global objects.
std::mutex& openmesh_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// Takes vertices and faces as they come. OpenMesh's own importers drop faces that do not fit their
/// neighbours.
class Soup : public OpenMesh::IO::BaseImporter {
 public:
  explicit Soup(std::filesystem::path path) : path_(std::move(path)) {}

  ForeignMesh mesh = {};

  OpenMesh::VertexHandle add_vertex(const OpenMesh::Vec3f& p) override {
    mesh.vertices.emplace_back(p[0], p[1], p[2]);
    return OpenMesh::VertexHandle(static_cast<int>(mesh.vertices.size()) - 1);
  }
  OpenMesh::VertexHandle add_vertex() override { return add_vertex(OpenMesh::Vec3f(0, 0, 0)); }
  void set_point(OpenMesh::VertexHandle v, const OpenMesh::Vec3f& p) override {
    mesh.vertices.at(static_cast<std::size_t>(v.idx())) = {p[0], p[1], p[2]};
  }
  OpenMesh::FaceHandle add_face(const VHandles& corners) override {
    if (corners.size() < 3)
      fail(path_, "face " + std::to_string(faces_) + ": expected 3 corners or more, found " +
                      std::to_string(corners.size()));
    for (std::size_t k = 2; k < corners.size(); ++k)
      mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0].idx()),
                                static_cast<std::uint32_t>(corners[k - 1].idx()),
                                static_cast<std::uint32_t>(corners[k].idx())});
    return OpenMesh::FaceHandle(static_cast<int>(faces_++));
  }
  std::size_t n_vertices() const override { return mesh.vertices.size(); }
  std::size_t n_faces() const override { return faces_; }
  std::size_t n_edges() const override { return 0; }

  // What the files that get here do not hold.
  using V = OpenMesh::VertexHandle;
  using H = OpenMesh::HalfedgeHandle;
  using E = OpenMesh::EdgeHandle;
  using F = OpenMesh::FaceHandle;
  using Status = OpenMesh::Attributes::StatusInfo;
  H add_edge(V, V) override { return H(); }
  F add_face(H) override { return F(); }
  void add_face_texcoords(F, V, const std::vector<OpenMesh::Vec2f>&) override {}
  void add_face_texcoords(F, V, const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(F, int) override {}
  void set_halfedge(V, H) override {}
  void set_normal(V, const OpenMesh::Vec3f&) override {}
  void set_normal(V, const OpenMesh::Vec3d&) override {}
  void set_normal(F, const OpenMesh::Vec3f&) override {}
  void set_normal(F, const OpenMesh::Vec3d&) override {}
  void set_color(V, const OpenMesh::Vec3uc&) override {}
  void set_color(V, const OpenMesh::Vec4uc&) override {}
  void set_color(V, const OpenMesh::Vec3f&) override {}
  void set_color(V, const OpenMesh::Vec4f&) override {}
  void set_color(E, const OpenMesh::Vec3uc&) override {}
  void set_color(E, const OpenMesh::Vec4uc&) override {}
  void set_color(E, const OpenMesh::Vec3f&) override {}
  void set_color(E, const OpenMesh::Vec4f&) override {}
  void set_color(F, const OpenMesh::Vec3uc&) override {}
  void set_color(F, const OpenMesh::Vec4uc&) override {}
  void set_color(F, const OpenMesh::Vec3f&) override {}
  void set_color(F, const OpenMesh::Vec4f&) override {}
  void set_texcoord(V, const OpenMesh::Vec2f&) override {}
  void set_texcoord(V, const OpenMesh::Vec3f&) override {}
  void set_texcoord(H, const OpenMesh::Vec2f&) override {}
  void set_texcoord(H, const OpenMesh::Vec3f&) override {}
  void set_status(V, const Status&) override {}
  void set_status(H, const Status&) override {}
  void set_status(E, const Status&) override {}
  void set_status(F, const Status&) override {}
  void set_next(H, H) override {}
  void set_face(H, F) override {}
  void request_face_texcoords2D() override {}
  void add_texture_information(int, std::string) override {}

 private:
  std::filesystem::path path_;
  std::size_t faces_ = 0;
};

/// What OpenMesh finds in a file of the given kind.
Soup read_with_openmesh(std::string content, const std::string& end, bool binary,
                        const std::filesystem::path& path) {
  const std::lock_guard lock(openmesh_mutex());
  omlog().disable();
  omout().disable();
  omerr().disable();
  Soup soup(path);
  std::istringstream stream(std::move(content));
  stream.imbue(std::locale::classic());
  OpenMesh::IO::Options options = OpenMesh::IO::Options::Default;
  if (binary) options += OpenMesh::IO::Options::Binary;
  if (!OpenMesh::IO::IOManager().read(stream, end, soup, options))
    fail(path, "expected a " + end + " file, found something that cannot be read as one");
  return soup;
}

// .ply (Turk 1994)

struct PlyType {
  std::string_view name = {};
  std::size_t size = 0;
  bool whole = false;
};

const PlyType* find_ply_type(std::string_view name) {
  static constexpr std::array<PlyType, 16> types = {{{"char", 1, true},
                                                     {"int8", 1, true},
                                                     {"uchar", 1, true},
                                                     {"uint8", 1, true},
                                                     {"short", 2, true},
                                                     {"int16", 2, true},
                                                     {"ushort", 2, true},
                                                     {"uint16", 2, true},
                                                     {"int", 4, true},
                                                     {"int32", 4, true},
                                                     {"uint", 4, true},
                                                     {"uint32", 4, true},
                                                     {"float", 4, false},
                                                     {"float32", 4, false},
                                                     {"double", 8, false},
                                                     {"float64", 8, false}}};
  const auto* const found = std::find_if(types.begin(), types.end(),
                                         [&](const PlyType& type) { return type.name == name; });
  return found == types.end() ? nullptr : found;
}

struct PlyProperty {
  std::string_view name = {};
  const PlyType* type = nullptr;
  const PlyType* count = nullptr;  // of a list, else none
};

struct PlyElement {
  std::string_view name = {};
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties = {};
};

struct PlyHeader {
  std::string_view format = {};
  std::vector<PlyElement> elements = {};
  std::string_view body = {};
};

PlyHeader parse_ply_header(std::string_view text, const std::filesystem::path& path) {
  PlyHeader header;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = take_line(text);
    const std::string_view whole_line = line;
    const std::string_view word = take_word(line);
    const auto expected = [&](const std::string& what) {
      fail_at(path, line_number, "expected " + what + ", found " + quoted(whole_line));
    };
    if (line_number == 1) {
      if (whole_line != "ply") expected("'ply'");
    } else if (word == "format") {
      header.format = take_word(line);
      if (header.format != "ascii" && header.format != "binary_little_endian" &&
          header.format != "binary_big_endian")
        expected("format ascii, binary_little_endian or binary_big_endian");
    } else if (word == "element") {
      PlyElement& element = header.elements.emplace_back();
      element.name = take_word(line);
      const std::optional<std::uint64_t> count = number<std::uint64_t>(take_word(line));
      if (!count) expected("element NAME COUNT");
      element.count = *count;
    } else if (word == "property") {
      if (header.elements.empty()) expected("an element first");
      PlyProperty property;
      std::string_view type = take_word(line);
      const bool list = type == "list";
      if (list) {
        property.count = find_ply_type(take_word(line));
        type = take_word(line);
      }
      property.type = find_ply_type(type);
      property.name = take_word(line);
      if (property.type == nullptr || property.name.empty() ||
          (list && (property.count == nullptr || !property.count->whole)))
        expected("property TYPE NAME or property list TYPE TYPE NAME");
      header.elements.back().properties.push_back(property);
    } else if (word == "end_header") {
      if (header.format.empty()) expected("the format before");
      header.body = text;
      return header;
    } else if (word != "comment" && word != "obj_info" && !word.empty()) {
      expected("a header of a .ply file");
    }
  }
  fail(path, "ends within its header");
}

/// The values behind the header, one after the other.
class PlyBody {
 public:
  PlyBody(const PlyHeader& header, std::filesystem::path path)
      : rest_(header.body),
        text_(header.format == "ascii"),
        swapped_(header.format == "binary_big_endian"),
        path_(std::move(path)) {}

  void begin(const PlyElement& element, std::uint64_t index) {
    element_ = &element;
    index_ = index;
  }

  /// As it stands there: bytes, or a word.
  std::string_view take(const PlyType& type) {
    if (text_) {
      const std::string_view word = take_word(rest_);
      if (word.empty()) fail_early();
      return word;
    }
    if (rest_.size() < type.size) fail_early();
    const std::string_view bytes = rest_.substr(0, type.size);
    rest_.remove_prefix(type.size);
    return bytes;
  }

  void copy(const PlyType& type, std::string& to) {
    const std::string_view value = take(type);
    if (text_ && (type.whole ? !number<std::int32_t>(value) : !is_coordinate(value)))
      fail_here(std::string("expected a ") + (type.whole ? "whole " : "") + "number, found " +
                quoted(value));
    to += value;
    if (text_) to += ' ';
  }

  std::uint64_t take_count(const PlyType& type) {
    const std::string_view value = take(type);
    if (text_) {
      const std::optional<std::uint64_t> count = number<std::uint64_t>(value);
      if (!count) fail_here("expected the length of a list, found " + quoted(value));
      return *count;
    }
    std::uint64_t count = 0;  // of a negative one a large one, which ends early
    for (std::size_t i = 0; i < type.size; ++i)
      count = count << 8 | static_cast<unsigned char>(value[swapped_ ? i : type.size - 1 - i]);
    return count;
  }

  /// Of type int.
  void put_count(std::uint64_t count, std::string& to) const {
    if (text_) {
      to += std::to_string(count) + ' ';
      return;
    }
    for (int i = 0; i < 4; ++i) to += static_cast<char>(count >> 8 * (swapped_ ? 3 - i : i) & 255U);
  }

  /// Bytes or words that can at most follow.
  std::size_t left() const { return rest_.size(); }

  [[noreturn]] void fail_here(const std::string& what) const {
    fail(path_, std::string(element_->name) + " " + std::to_string(index_) + ": " + what);
  }
  [[noreturn]] void fail_early() const {
    fail_here("the file ends here; expected " + std::to_string(element_->count));
  }

 private:
  std::string_view rest_;
  bool text_ = false;
  bool swapped_ = false;
  std::filesystem::path path_;
  const PlyElement* element_ = nullptr;
  std::uint64_t index_ = 0;
};

bool is_place(const PlyProperty& p) { return p.name == "x" || p.name == "y" || p.name == "z"; }
bool is_corners(const PlyProperty& p) {
  return p.name == "vertex_indices" || p.name == "vertex_index";
}

ForeignMesh read_ply(const std::filesystem::path& path) {
  std::string content = content_of(path);
  const PlyHeader header = parse_ply_header(content, path);
  std::string vertices, faces, vertex_header, face_header;
  std::uint64_t vertex_count = 0, face_count = 0;
  PlyBody body(header, path);
  for (const PlyElement& element : header.elements) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    if (element.properties.empty()) continue;
    std::size_t needed = 0;
    for (const PlyProperty& p : element.properties) {
      const std::string type(p.type->name), name(p.name);
      if (is_vertex && is_place(p)) {
        if (p.count != nullptr || p.type->whole)
          fail(path, name + ": expected float or double, found " + type);
        vertex_header += "property " + type + " " + name + "\n";
        ++needed;
      }
      if (is_face && is_corners(p)) {
        if (p.count == nullptr || !p.type->whole)
          fail(path, name + ": expected a list of whole numbers, found " + type);
        face_header += "property list int " + type + " " + name + "\n";
        ++needed;
      }
    }
    if (is_vertex && (needed != 3 || vertex_count > 0))
      fail(path, "expected vertices with x, y and z, once each");
    if (is_face && (needed != 1 || face_count > 0))
      fail(path, "expected faces with vertex_indices, once");
    for (std::uint64_t i = 0; i < element.count; ++i) {
      body.begin(element, i);
      for (const PlyProperty& p : element.properties) {
        if (p.count == nullptr) {
          if (is_vertex && is_place(p)) {
            body.copy(*p.type, vertices);
          } else {
            body.take(*p.type);
          }
          continue;
        }
        const std::uint64_t length = body.take_count(*p.count);
        if (length > body.left()) body.fail_early();
        const bool wanted = is_face && is_corners(p);
        if (wanted) body.put_count(length, faces);
        for (std::uint64_t k = 0; k < length; ++k) {
          if (wanted) {
            body.copy(*p.type, faces);
          } else {
            body.take(*p.type);
          }
        }
      }
    }
    if (is_vertex) vertex_count = element.count;
    if (is_face) face_count = element.count;
  }
  if (vertex_count > std::numeric_limits<std::int32_t>::max() ||
      face_count > std::numeric_limits<std::int32_t>::max())
    fail(path, "expected less than 2^31 vertices and faces");
  if (face_count == 0 || vertex_count == 0) return {};
  std::string plain = "ply\nformat " + std::string(header.format) + " 1.0\nelement vertex " +
                      std::to_string(vertex_count) + "\n" + vertex_header + "element face " +
                      std::to_string(face_count) + "\n" + face_header + "end_header\n";
  content = {};
  plain += vertices;
  vertices = {};
  plain += faces;
  faces = {};
  Soup soup = read_with_openmesh(std::move(plain), ".ply", false, path);
  if (soup.n_vertices() != vertex_count || soup.n_faces() != face_count)
    fail(path, "expected " + std::to_string(vertex_count) + " vertices and " +
                   std::to_string(face_count) + " faces, found " +
                   std::to_string(soup.n_vertices()) + " and " + std::to_string(soup.n_faces()));
  return std::move(soup.mesh);
}

// .stl (3D Systems 1989)

constexpr std::size_t stl_header_size = 84, stl_triangle_size = 50;

/// Bytes that a binary file of as many triangles as it says has.
std::optional<std::uint64_t> binary_stl_size(std::string_view content) {
  if (content.size() < stl_header_size) return std::nullopt;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < 4; ++i)
    count |= std::uint64_t{static_cast<unsigned char>(content[80 + i])} << 8 * i;
  return stl_header_size + stl_triangle_size * count;
}

void check_binary_stl(std::string_view content, const std::filesystem::path& path) {
  for (std::size_t at = stl_header_size; at < content.size(); at += stl_triangle_size)
    for (std::size_t k = 3; k < 12; ++k) {  // behind the normal
      std::uint32_t bits = 0;
      for (std::size_t i = 0; i < 4; ++i)
        bits |= std::uint32_t{static_cast<unsigned char>(content[at + 4 * k + i])} << 8 * i;
      if ((bits >> 23 & 255U) == 255)
        fail(path, "triangle " + std::to_string((at - stl_header_size) / stl_triangle_size) +
                       ": expected finite coordinates");
    }
}

/// Lower case, one blank between words, no names.
std::string plain_text_stl(std::string_view content, const std::filesystem::path& path) {
  static constexpr std::array<std::string_view, 7> order = {
      "facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet"};
  std::string plain = "solid\n";
  std::size_t next = 0;  // in `order`
  bool within_solid = false;
  std::size_t line_number = 0;
  while (!content.empty()) {
    ++line_number;
    std::string_view line = take_line(content);
    const std::string_view whole_line = trimmed(line);
    if (whole_line.empty()) continue;
    const auto lower = [](std::string_view word) {
      std::string result(word);
      for (char& c : result) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
      return result;
    };
    const std::string word = lower(take_word(line));
    if (next == 0 && (word == "solid" || word == "endsolid")) {
      if (within_solid == (word == "solid"))
        fail_at(path, line_number,
                "expected " + std::string(within_solid ? "'endsolid'" : "'solid'") + ", found " +
                    quoted(whole_line));
      within_solid = !within_solid;
      continue;
    }
    if (!within_solid || word != order.at(next))
      fail_at(path, line_number,
              "expected '" + std::string(within_solid ? order.at(next) : "solid") + "', found " +
                  quoted(whole_line));
    next = (next + 1) % order.size();
    if (word == "vertex") {
      plain += "vertex";
      for (int k = 0; k < 3; ++k) {
        const std::string_view coordinate = take_word(line);
        if (!is_coordinate(coordinate))
          fail_at(path, line_number, "expected 3 coordinates, found " + quoted(whole_line));
        plain.append(" ").append(coordinate);
      }
      plain += '\n';
    } else {
      // OpenMesh reads a normal that nobody asks for.
      plain += word == "facet" ? "facet normal 0 0 1" : word == "outer" ? "outer loop" : word;
      plain += '\n';
    }
  }
  if (within_solid) fail_at(path, line_number, "the file ends here; expected 'endsolid'");
  return plain + "endsolid\n";
}

ForeignMesh read_stl(const std::filesystem::path& path) {
  std::string content = content_of(path);
  const std::optional<std::uint64_t> binary_size = binary_stl_size(content);
  if (binary_size == content.size()) {
    check_binary_stl(content, path);
    return std::move(read_with_openmesh(std::move(content), ".stl", true, path).mesh);
  }
  std::string_view start(content);
  const std::string_view word = take_word(start);
  if (word == "solid" || word == "SOLID")
    return std::move(read_with_openmesh(plain_text_stl(content, path), ".stl", false, path).mesh);
  if (!binary_size)
    fail(path, "expected a .stl file, found " + std::to_string(content.size()) + " bytes");
  fail(path, "expected " + std::to_string(*binary_size) +
                 " bytes for as many triangles as it says, found " +
                 std::to_string(content.size()));
}

// .obj (Wavefront)

void check_obj(std::string_view content, const std::filesystem::path& path) {
  std::size_t line_number = 0;
  while (!content.empty()) {
    ++line_number;
    std::string_view line = take_line(content);
    const std::string_view whole_line = trimmed(line);
    const std::string_view word = take_word(line);
    if (word == "v") {
      for (int k = 0; k < 3; ++k)
        if (!is_coordinate(take_word(line)))
          fail_at(path, line_number, "expected 3 coordinates, found " + quoted(whole_line));
    } else if (word == "f") {
      int corners = 0;
      for (std::string_view corner = take_word(line); !corner.empty(); corner = take_word(line)) {
        ++corners;
        const std::optional<std::int32_t> index =
            number<std::int32_t>(corner.substr(0, corner.find('/')));
        if (!index || *index == 0)
          fail_at(path, line_number, "expected numbers of vertices, found " + quoted(whole_line));
      }
      if (corners < 3)
        fail_at(path, line_number, "expected 3 corners or more, found " + quoted(whole_line));
    }
  }
}

/// What tinyobjloader calls back with.
struct ObjReader {
  ForeignMesh mesh = {};
  std::vector<std::string> names = {};
  std::map<std::string, std::uint32_t> known = {};
  std::string material = {};
  std::string shape = {};

  static ObjReader& of(void* user) { return *static_cast<ObjReader*>(user); }

  static void vertex(void* user, float x, float y, float z, float) {
    of(user).mesh.vertices.emplace_back(x, y, z);
  }
  static void face(void* user, tinyobj::index_t* corners, int count) {
    ObjReader& reader = of(user);
    const std::string& name = reader.material.empty() ? reader.shape : reader.material;
    const auto group = static_cast<std::uint32_t>(reader.names.size());
    const auto [place, is_new] = reader.known.try_emplace(name, group);
    if (is_new) reader.names.push_back(name);
    const auto index = [&](int k) {
      const std::int64_t i = corners[k].vertex_index;  // from 1 on, or back from the last one
      const std::int64_t vertices = static_cast<std::int64_t>(reader.mesh.vertices.size());
      return static_cast<std::uint32_t>(i > 0 ? i - 1 : std::max<std::int64_t>(vertices + i, -1));
    };
    for (int k = 2; k < count; ++k) {
      reader.mesh.triangles.push_back({index(0), index(k - 1), index(k)});
      reader.mesh.group.push_back(place->second);
    }
  }
  static void use_material(void* user, const char* name, int) { of(user).material = trimmed(name); }
  static void begin_group(void* user, const char** names, int count) {
    of(user).shape = join({names, names + count}, " ");
  }
  static void begin_object(void* user, const char* name) { of(user).shape = trimmed(name); }
};

ForeignMesh read_obj(const std::filesystem::path& path) {
  std::string content = content_of(path);
  check_obj(content, path);
  tinyobj::callback_t callback;
  callback.vertex_cb = ObjReader::vertex;
  callback.index_cb = ObjReader::face;
  callback.usemtl_cb = ObjReader::use_material;
  callback.group_cb = ObjReader::begin_group;
  callback.object_cb = ObjReader::begin_object;
  ObjReader reader;
  std::istringstream stream(std::move(content));
  std::string warning, error;
  // Without a reader of materials no other file is looked for.
  if (!tinyobj::LoadObjWithCallback(stream, callback, &reader, nullptr, &warning, &error))
    fail(path, "expected a .obj file: " + error);
  reader.mesh.groups = std::move(reader.names);
  return std::move(reader.mesh);
}

}  // namespace

ForeignMesh read_foreign_mesh(const std::filesystem::path& path) {
  std::string end = path.extension().string();
  for (char& c : end) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (end != ".ply" && end != ".stl" && end != ".obj")
    throw std::invalid_argument(path.string() + ": expected a name ending in .ply, .stl or .obj");
  ForeignMesh mesh = end == ".ply"   ? read_ply(path)
                     : end == ".stl" ? read_stl(path)
                                     : read_obj(path);
  if (mesh.triangles.empty()) fail(path, "holds no triangles");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t corner : mesh.triangles[t])
      if (corner >= mesh.vertices.size())
        fail(path, "triangle " + std::to_string(t) + ": expected vertices below " +
                       std::to_string(mesh.vertices.size()) + ", found " +
                       std::to_string(static_cast<std::int32_t>(corner)));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (!mesh.vertices[v].allFinite())
      fail(path, "vertex " + std::to_string(v) + ": expected finite coordinates");
  if (mesh.groups.empty()) {
    mesh.groups = {""};
    mesh.group.assign(mesh.triangles.size(), 0);
  }
  return mesh;
}

}  // namespace minescan

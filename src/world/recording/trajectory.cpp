/// Writers of trajectories in the formats of other programs.
#include <jfpx/error.hpp>
#include <jfpx/trajectory.hpp>
#include <jfpx/world.hpp>

#include "src/base/atomic_file.hpp"
#include "src/base/file.hpp"
#include "src/base/system.hpp"
#include "src/scene/compound.hpp"

#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <concepts>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

/// Columns of a frame, with a row for each body.
struct FrameColumns {
  double time = 0;  ///< [s]
  std::uint64_t step = 0;
  std::vector<std::uint32_t> ids;
  std::vector<Real> radii;
  std::vector<std::uint8_t> shapes;
  std::vector<BodyState> states;

  void clear() {
    ids.clear();
    radii.clear();
    shapes.clear();
  }
  void add(std::uint32_t id, const Shape& shape) {
    ids.push_back(id);
    radii.push_back(outer_radius(shape));
    shapes.push_back(static_cast<std::uint8_t>(shape.index()));
  }
};

/// Appends the shortest text that parses to the same number.
template <class Number>
void append_number(std::string* text, Number value) {
  char digits[32];
  text->append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}
void append_numbers(std::string* text, std::initializer_list<Real> values) {
  for (const Real value : values) {
    *text += ' ';
    append_number(text, value);
  }
}

}  // namespace

struct TrajectoryWriter::Format {
  virtual ~Format() = default;
  virtual void append(const FrameColumns& frame) = 0;
  virtual void finish() = 0;

  FrameColumns columns;  ///< of the current frame
};

/// The format of QUIP and ASE: a number of bodies, a line of properties, and a line for each body.
struct TrajectoryWriter::ExtendedXyz final : Format {
  explicit ExtendedXyz(const std::string& path) : file(path) {}

  void append(const FrameColumns& frame) override {
    constexpr std::size_t kBlock = std::size_t{1} << 16;
    text.clear();
    append_number(&text, frame.states.size());
    text +=
        "\nProperties=species:S:1:pos:R:3:id:I:1:radius:R:1:shape:I:1:orientation:R:4:velo:R:3:"
        "angular_velocity:R:3 Time=";
    append_number(&text, frame.time);
    text += " Step=";
    append_number(&text, frame.step);
    text += " pbc=\"F F F\"\n";
    for (std::size_t i = 0; i < frame.states.size(); ++i) {
      append_line(frame, i);
      if (text.size() < kBlock) continue;
      file.write(text);
      text.clear();
    }
    file.write(text);
  }
  void finish() override { file.finish(); }

  /// The species is that of a dummy atom.
  void append_line(const FrameColumns& frame, std::size_t i) {
    const auto& [p, q, v, w] = frame.states[i];
    text += 'X';
    append_numbers(&text, {p.x, p.y, p.z});
    text += ' ';
    append_number(&text, frame.ids[i]);
    append_numbers(&text, {frame.radii[i]});
    text += ' ';
    append_number(&text, frame.shapes[i]);
    append_numbers(&text, {q.x, q.y, q.z, q.w, v.x, v.y, v.z, w.x, w.y, w.z});
    text += '\n';
  }

  AtomicFile file;
  std::string text;
};

namespace {

std::string xml_text(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

template <class Item>
constexpr const char* vtk_type() {
  if (std::same_as<Item, Real>) return sizeof(Real) == 4 ? "Float32" : "Float64";
  if (std::same_as<Item, std::uint8_t>) return "UInt8";
  if (std::same_as<Item, std::uint32_t>) return "UInt32";
  static_assert(sizeof(Item) < 8 || std::floating_point<Item> || std::same_as<Item, std::int64_t>);
  return "Int64";
}

/// The XML of a file whose arrays follow as raw bytes: each has its size, as a 64-bit number.
class VtkFile {
 public:
  explicit VtkFile(const std::string& path) : file_(path) {}

  void write(std::string_view xml) { file_.write(xml); }
  /// Announces an array, whose bytes write_array() writes.
  template <class Item>
  void declare(const char* name, std::size_t components, std::size_t rows) {
    write(std::string("        <DataArray type=\"") + vtk_type<Item>() + "\" Name=\"" + name +
          "\" NumberOfComponents=\"" + std::to_string(components) +
          "\" format=\"appended\" offset=\"" + std::to_string(offset_) + "\"/>\n");
    offset_ += sizeof(std::uint64_t) + rows * components * sizeof(Item);
  }
  /// Writes an array, in the order of their declarations.
  template <class Item>
  void write_array(std::span<const Item> items) {
    const std::uint64_t size = items.size_bytes();
    file_.write({reinterpret_cast<const char*>(&size), sizeof size});
    file_.write({reinterpret_cast<const char*>(items.data()), size});
  }
  void finish() { file_.finish(); }

 private:
  AtomicFile file_;
  std::uint64_t offset_ = 0;
};

}  // namespace

/// A file for each frame, and an index with their times. The files are moved to their folder when
/// all are complete.
struct TrajectoryWriter::Vtk final : Format {
  explicit Vtk(const fs::path& path)
      : index(to_text(path)),
        name(to_text(path.stem())),
        folder(path.parent_path() / path.stem()),
        part(path.parent_path() / to_path(name + ".part")) {
    std::error_code error;
    if (fs::exists(folder) && !fs::is_directory(folder)) fail(folder, ENOTDIR);
    fs::create_directory(part, error);
    if (error) fail(part, error.value());
    remove_frames(part, 0);  // of a run that was killed
    index.write(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n");
  }
  ~Vtk() override {
    try {
      remove_frames(part, 0);
    } catch (const std::bad_alloc&) {  // the files remain
    }
    std::error_code ignored;
    fs::remove(part, ignored);  // unless it has other files
  }

  void append(const FrameColumns& frame) override {
    require_success();
    failed = true;
    const std::string file = file_name(frames);
    std::string time;
    append_number(&time, frame.time);
    index.write("    <DataSet timestep=\"" + time + "\" file=\"" + xml_text(name + '/' + file) +
                "\"/>\n");
    write_frame(frame, time, part / to_path(file));
    ++frames;
    failed = false;
  }

  void finish() override {
    require_success();
    failed = true;
    index.write("  </Collection>\n</VTKFile>\n");
    index.close();
    std::error_code error;
    fs::create_directory(folder, error);
    if (error) fail(folder, error.value());
    for (std::size_t i = 0; i < frames; ++i) {
      fs::rename(part / to_path(file_name(i)), folder / to_path(file_name(i)), error);
      if (error) fail(folder / to_path(file_name(i)), error.value());
    }
    remove_frames(folder, frames);
    fs::remove(part, error);
    index.finish();
    failed = false;
  }

  std::string file_name(std::size_t frame) const {
    char number[32];
    std::snprintf(number, sizeof number, "_%06zu.vtp", frame);
    return name + number;
  }
  /// Removes the frames of this name from number `first`.
  void remove_frames(const fs::path& from, std::size_t first) const {
    const std::string before = name + '_';
    std::error_code ignored;
    std::vector<fs::path> frames_there;
    for (fs::directory_iterator it(from, ignored), end; it != end; it.increment(ignored)) {
      const std::string file = to_text(it->path().filename());
      std::size_t number = 0;
      if (!file.starts_with(before)) continue;
      const char* const digits = file.data() + before.size();
      const auto [rest, bad] = std::from_chars(digits, file.data() + file.size(), number);
      if (bad == std::errc() && std::string_view(rest) == ".vtp" && number >= first) {
        frames_there.push_back(it->path());
      }
    }
    for (const fs::path& path : frames_there) fs::remove(path, ignored);
  }
  void require_success() const {
    if (failed) throw FileError(to_text(folder) + ": an earlier write failed");
  }
  [[noreturn]] static void fail(const fs::path& path, int error_number) {
    throw FileError(file_message(to_text(path), "can't be written", error_number));
  }

  void write_frame(const FrameColumns& frame, const std::string& time, const fs::path& path) {
    const std::size_t n = frame.states.size();
    const std::string points = std::to_string(n);
    VtkFile file(to_text(path));
    file.write(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n"
        "  <PolyData>\n"
        "    <FieldData>\n"
        "      <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
        "format=\"ascii\">" +
        time +
        "</DataArray>\n"
        "    </FieldData>\n"
        "    <Piece NumberOfPoints=\"" +
        points + "\" NumberOfVerts=\"" + points +
        "\">\n"
        "      <PointData Scalars=\"radius\" Vectors=\"velocity\">\n");
    file.declare<std::uint32_t>("id", 1, n);
    file.declare<Real>("radius", 1, n);
    file.declare<std::uint8_t>("shape", 1, n);
    file.declare<Real>("orientation", 4, n);
    file.declare<Real>("velocity", 3, n);
    file.declare<Real>("angular_velocity", 3, n);
    file.write("      </PointData>\n      <Points>\n");
    file.declare<Real>("position", 3, n);
    file.write("      </Points>\n      <Verts>\n");
    file.declare<std::int64_t>("connectivity", 1, n);
    file.declare<std::int64_t>("offsets", 1, n);
    file.write(
        "      </Verts>\n"
        "    </Piece>\n"
        "  </PolyData>\n"
        "  <AppendedData encoding=\"raw\">\n_");
    file.write_array<std::uint32_t>(frame.ids);
    file.write_array<Real>(frame.radii);
    file.write_array<std::uint8_t>(frame.shapes);
    const auto write_rows = [&](const auto& row_of) {
      numbers.clear();
      for (const BodyState& state : frame.states) {
        const auto row = row_of(state);
        numbers.insert(numbers.end(), row.begin(), row.end());
      }
      file.write_array<Real>(numbers);
    };
    const auto row = [](const Vec3& v) { return std::array{v.x, v.y, v.z}; };
    write_rows([](const BodyState& s) {
      const Quat& q = s.orientation;
      return std::array{q.w, q.x, q.y, q.z};
    });
    write_rows([&](const BodyState& s) { return row(s.velocity); });
    write_rows([&](const BodyState& s) { return row(s.angular_velocity); });
    write_rows([&](const BodyState& s) { return row(s.position); });
    std::vector<std::int64_t> vertices(n + 1);  // one in each cell
    std::iota(vertices.begin(), vertices.end(), std::int64_t{0});
    file.write_array<std::int64_t>(std::span(vertices).first(n));
    file.write_array<std::int64_t>(std::span(vertices).last(n));
    file.write("\n  </AppendedData>\n</VTKFile>\n");
    file.finish();
  }

  AtomicFile index;
  std::string name;       ///< without extension
  fs::path folder, part;  ///< of the frames; of the frames before finish()
  std::size_t frames = 0;
  bool failed = false;
  std::vector<Real> numbers;
};

TrajectoryWriter::TrajectoryWriter(const std::string& path) {
  const fs::path extension = to_path(path).extension();
  if (extension == ".xyz" || extension == ".extxyz") {
    format_ = std::make_unique<ExtendedXyz>(path);
  } else if (extension == ".pvd") {
    format_ = std::make_unique<Vtk>(to_path(path));
  } else {
    throw InvalidArgument("trajectory " + path + " has the extension \"" + to_text(extension) +
                          "\"; it must be .xyz or .extxyz (extended XYZ), or .pvd (VTK)");
  }
}

TrajectoryWriter::~TrajectoryWriter() = default;
TrajectoryWriter::TrajectoryWriter(TrajectoryWriter&&) noexcept = default;
TrajectoryWriter& TrajectoryWriter::operator=(TrajectoryWriter&&) noexcept = default;

void TrajectoryWriter::append(const World& world) {
  FrameColumns& frame = format_->columns;
  frame.clear();
  frame.time = world.time();
  frame.step = world.steps();
  world.states(&frame.states);
  for (const BodyId id : world.bodies()) frame.add(id.index, world.shape(id));
  format_->append(frame);
}

void TrajectoryWriter::append(const Scene& scene, std::uint64_t step,
                              std::span<const BodyState> states) {
  if (states.size() != scene.bodies.size()) {
    throw InvalidArgument("there are " + std::to_string(states.size()) +
                          " states; there must be one for each of " +
                          std::to_string(scene.bodies.size()) + " bodies");
  }
  FrameColumns& frame = format_->columns;
  frame.clear();
  frame.time = static_cast<double>(step) * static_cast<double>(scene.dt);
  frame.step = step;
  frame.states.assign(states.begin(), states.end());
  for (std::uint32_t i = 0; i < states.size(); ++i) frame.add(i, scene.bodies[i].shape);
  format_->append(frame);
}

void TrajectoryWriter::finish() { format_->finish(); }

}  // namespace JFPX_ABI
}  // namespace jfpx

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats.h"

namespace fcl_fibers::scenes {
namespace {

enum class NumberType { kInt8, kInt16, kInt32, kInt64, kFloat, kDouble };

struct NamedType {
  std::string_view name;
  NumberType type;
  std::uint64_t size;
};

// Signs do not matter where numbers are counts, indices or skipped.
constexpr NamedType kTypes[] = {
    {"char", NumberType::kInt8, 1},          {"unsigned_char", NumberType::kInt8, 1},
    {"short", NumberType::kInt16, 2},        {"unsigned_short", NumberType::kInt16, 2},
    {"int", NumberType::kInt32, 4},          {"unsigned_int", NumberType::kInt32, 4},
    {"long", NumberType::kInt64, 8},         {"unsigned_long", NumberType::kInt64, 8},
    {"vtktypeint32", NumberType::kInt32, 4}, {"vtktypeuint32", NumberType::kInt32, 4},
    {"vtktypeint64", NumberType::kInt64, 8}, {"vtktypeuint64", NumberType::kInt64, 8},
    {"vtkidtype", NumberType::kInt32, 4},    {"float", NumberType::kFloat, 4},
    {"double", NumberType::kDouble, 8},
};

std::string lowercase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

/// The legacy format: words, and after the line that announces them, arrays: words again or, big
/// endian, numbers as they are. See VTK File Formats, https://docs.vtk.org, section "Simple Legacy
/// Formats"; of version 5 section "Legacy vtk file version 5.1".
class VtkParser {
 public:
  explicit VtkParser(ByteReader& file) : file_(file) {}

  ParsedFibers parse() {
    readHead();
    while (true) {
      file_.skipSpace();
      const std::uint64_t at = file_.offset();
      const std::string keyword = lowercase(file_.word());
      if (keyword.empty() || keyword == "point_data" || keyword == "cell_data") break;
      if (keyword == "points") {
        readPoints(at);
      } else if (keyword == "lines") {
        readLines(at);
      } else if (keyword == "vertices" || keyword == "polygons" || keyword == "triangle_strips") {
        skipCells();
      } else if (keyword == "field") {
        skipField();
      } else if (keyword == "metadata") {
        skipMetadata();
      } else {
        file_.refuse(at, "'", ByteReader::shortened(keyword), "' is no keyword of polygonal data");
      }
    }
    if (parsed_.scene.points.empty()) file_.refuse(file_.size(), "there are no lines");
    if (!binary_) expectLineEnd(file_, parsed_);
    return std::move(parsed_);
  }

 private:
  void readHead() {
    constexpr std::string_view kMagic = "# vtk DataFile Version ";
    file_.setPlaces(ByteReader::Places::kLines);
    std::uint64_t at = file_.offset();
    const std::string_view first = file_.line();
    if (first.substr(0, kMagic.size()) != kMagic) {
      file_.refuse(at, "the file does not start with '", kMagic, "'");
    }
    const std::string_view version = first.substr(kMagic.size());
    const std::string_view major = version.substr(0, version.find('.'));
    if (major.size() != 1 || major[0] < '1' || major[0] > '5') {
      file_.refuse(at, "version is '", ByteReader::shortened(version), "', known are 1 to 5");
    }
    has_offsets_ = major[0] == '5';
    file_.line();  // title

    at = file_.offset();
    const std::string kind = lowercase(file_.word());
    if (kind != "ascii" && kind != "binary") {
      file_.refuse(at, "'", ByteReader::shortened(kind), "' is neither ASCII nor BINARY");
    }
    binary_ = kind == "binary";
    if (binary_) file_.setPlaces(ByteReader::Places::kBytes);

    at = file_.offset();
    const std::string keyword = lowercase(file_.word());
    const std::string data_set = lowercase(file_.word());
    if (keyword != "dataset" || data_set != "polydata") {
      file_.refuse(at, "'", ByteReader::shortened(keyword + " " + data_set),
                   "' is not DATASET POLYDATA");
    }
  }

  std::uint64_t readCount(const char* part) { return file_.wordAsNumber<std::uint64_t>(part); }

  const NamedType& readType(const char* part) {
    const std::string_view word = file_.word();
    if (word.empty()) file_.refuseEnd(part);
    const std::string name = lowercase(word);
    for (const NamedType& type : kTypes) {
      if (type.name == name) return type;
    }
    file_.refuse(file_.offset() - word.size(), "numbers of type '", ByteReader::shortened(word),
                 "' are not read");
  }

  /// Before `count` numbers of some size: refuses what the file cannot hold.
  void startArray(std::uint64_t count, std::uint64_t size, const char* part) {
    const std::uint64_t at = file_.offset();
    if (binary_) file_.line();  // what is left of the line that announces them
    // In text a number takes a digit and, except the last one, a space.
    const std::uint64_t most = binary_ ? file_.remaining() / size : (file_.remaining() + 1) / 2;
    if (count > most) {
      file_.refuse(at, part, " have ", count, " numbers, the file has room for ", most);
    }
  }

  void skipNumbers(std::uint64_t count, const NamedType& type, const char* part) {
    startArray(count, type.size, part);
    if (binary_) {
      file_.take(count * type.size, part);
      return;
    }
    for (std::uint64_t i = 0; i < count; ++i) {
      if (file_.word().empty()) file_.refuseEnd(part);
    }
  }

  /// A count, an offset or an index: not negative.
  std::uint64_t readIndex(const NamedType& type, const char* part) {
    file_.skipSpaceUnless(binary_);
    const std::uint64_t at = file_.offset();
    const std::int64_t value = !binary_ ? file_.wordAsNumber<std::int64_t>(part)
                               : type.type == NumberType::kInt64
                                   ? file_.number<std::int64_t>(part, ByteOrder::kBig)
                                   : file_.number<std::int32_t>(part, ByteOrder::kBig);
    if (value < 0) file_.refuse(at, part, " have a number of ", value);
    return static_cast<std::uint64_t>(value);
  }

  double readCoordinate(const NamedType& type) {
    if (!binary_) return file_.wordAsNumber<double>("the points");
    return type.type == NumberType::kFloat ? file_.coordinate<float>(ByteOrder::kBig)
                                           : file_.coordinate<double>(ByteOrder::kBig);
  }

  void readPoints(std::uint64_t at) {
    if (!points_.empty()) file_.refuse(at, "there are two sets of points");
    const std::uint64_t count = readCount("the points");
    const NamedType& type = readType("the points");
    if (type.type != NumberType::kFloat && type.type != NumberType::kDouble) {
      file_.refuse(at, "points are of type ", type.name, ", read are float and double");
    }
    if (count > std::numeric_limits<std::uint64_t>::max() / 3) file_.refuseEnd("the points");
    startArray(3 * count, type.size, "the points");
    parsed_.is_float = type.type == NumberType::kFloat;
    points_.resize(static_cast<std::size_t>(count));
    for (Point& point : points_) {
      for (double& coordinate : point) coordinate = readCoordinate(type);
    }
  }

  void addPoint(std::uint64_t at, std::uint64_t index) {
    if (index >= points_.size()) {
      file_.refuse(at, "a line has point ", index, ", there are ", points_.size(),
                   " before the lines");
    }
    parsed_.scene.points.push_back(points_[static_cast<std::size_t>(index)]);
  }

  void readLines(std::uint64_t at) {
    if (!parsed_.scene.points.empty()) file_.refuse(at, "there are two sets of lines");
    const std::uint64_t first = readCount("the lines");
    const std::uint64_t second = readCount("the lines");
    if (first == 0) return;
    if (has_offsets_) {
      readOffsetLines(at, first, second);
    } else {
      readCountedLines(at, first, second);
    }
  }

  /// `size` numbers: of each line the number of points, then their indices.
  void readCountedLines(std::uint64_t at, std::uint64_t lines, std::uint64_t size) {
    const NamedType& type = *find("int");
    startArray(size, type.size, "the lines");
    if (lines > size) file_.refuse(at, lines, " lines have ", size, " numbers only");
    parsed_.scene.points.reserve(static_cast<std::size_t>(size - lines));
    parsed_.scene.point_begin.reserve(static_cast<std::size_t>(lines) + 1);
    std::uint64_t left = size;
    for (std::uint64_t line = 0; line < lines; ++line) {
      file_.skipSpaceUnless(binary_);
      const std::uint64_t start = file_.offset();
      if (left == 0) file_.refuse(at, lines, " lines have more than ", size, " numbers");
      const std::uint64_t count = readIndex(type, "the lines");
      if (count == 0) file_.refuse(start, "line ", line, " has no points");
      if (count > left - 1) {
        file_.refuse(start, "line ", line, " has ", count, " points, there are ", left - 1,
                     " numbers left of ", size);
      }
      left -= count + 1;
      for (std::uint64_t i = 0; i < count; ++i) readPointOfLine(type);
      parsed_.endFiber();
    }
    if (left != 0) file_.refuse(at, lines, " lines have ", size - left, " numbers, not ", size);
  }

  /// The index of each line's first point in the list of points, with its end; then that list.
  void readOffsetLines(std::uint64_t at, std::uint64_t offsets, std::uint64_t indices) {
    expectKeyword("OFFSETS");
    const NamedType& offset_type = readIndexType();
    startArray(offsets, offset_type.size, "the offsets");
    std::vector<std::size_t>& begin = parsed_.scene.point_begin;
    begin.clear();
    begin.reserve(static_cast<std::size_t>(offsets));
    for (std::uint64_t i = 0; i < offsets; ++i) {
      file_.skipSpaceUnless(binary_);
      const std::uint64_t start = file_.offset();
      const std::uint64_t offset = readIndex(offset_type, "the offsets");
      if (offset > indices || (i == 0 ? offset != 0 : offset <= begin.back())) {
        file_.refuse(start, "the offsets do not ascend strictly from 0 to ", indices);
      }
      begin.push_back(static_cast<std::size_t>(offset));
    }
    if (begin.back() != indices) {
      file_.refuse(at, "the offsets end at ", begin.back(), " of ", indices, " points");
    }

    expectKeyword("CONNECTIVITY");
    const NamedType& index_type = readIndexType();
    startArray(indices, index_type.size, "the lines");
    parsed_.scene.points.reserve(static_cast<std::size_t>(indices));
    for (std::uint64_t i = 0; i < indices; ++i) readPointOfLine(index_type);
  }

  void readPointOfLine(const NamedType& type) {
    file_.skipSpaceUnless(binary_);
    const std::uint64_t start = file_.offset();
    addPoint(start, readIndex(type, "the lines"));
  }

  static const NamedType* find(std::string_view name) {
    return std::find_if(std::begin(kTypes), std::end(kTypes),
                        [&](const NamedType& type) { return type.name == name; });
  }

  const NamedType& readIndexType() {
    file_.skipSpace();
    const std::uint64_t at = file_.offset();
    const NamedType& type = readType("the lines");
    if (type.type != NumberType::kInt32 && type.type != NumberType::kInt64) {
      file_.refuse(at, "indices are of type ", type.name, ", read are those of 32 and 64 bits");
    }
    return type;
  }

  void expectKeyword(std::string_view keyword) {
    file_.skipSpace();
    const std::uint64_t at = file_.offset();
    const std::string_view word = file_.word();
    if (lowercase(word) == lowercase(keyword)) return;
    file_.refuse(at, "'", ByteReader::shortened(word), "' is not ", keyword);
  }

  void skipCells() {
    const std::uint64_t first = readCount("the cells");
    const std::uint64_t second = readCount("the cells");
    if (!has_offsets_) {
      skipNumbers(second, *find("int"), "the cells");
    } else if (first > 0) {
      expectKeyword("OFFSETS");
      skipNumbers(first, readIndexType(), "the cells");
      expectKeyword("CONNECTIVITY");
      skipNumbers(second, readIndexType(), "the cells");
    }
  }

  /// Arrays beside the data set's own: name, components, tuples, type.
  void skipField() {
    file_.word();  // name
    const std::uint64_t arrays = readCount("the field");
    for (std::uint64_t i = 0; i < arrays; ++i) {
      file_.skipSpace();
      const std::uint64_t at = file_.offset();
      if (file_.atEnd()) file_.refuseEnd("the field");
      if (lowercase(file_.word()) == "metadata") {
        skipMetadata();
        --i;
        continue;
      }
      const std::uint64_t components = readCount("the field");
      const std::uint64_t tuples = readCount("the field");
      const NamedType& type = readType("the field");
      if (components != 0 && tuples > file_.size() / components) {
        file_.refuse(at, "an array has ", tuples, " times ", components, " numbers, the file has ",
                     file_.size(), " bytes");
      }
      skipNumbers(components * tuples, type, "the field");
    }
  }

  /// Text in both kinds of files, up to a blank line.
  void skipMetadata() {
    file_.line();
    while (!file_.atEnd() && !file_.line().empty()) {
    }
  }

  ByteReader& file_;
  ParsedFibers parsed_;
  std::vector<Point> points_;
  bool binary_ = false;
  bool has_offsets_ = false;  ///< from version 5 on
};

}  // namespace

ParsedFibers parseVtk(ByteReader& file) { return VtkParser(file).parse(); }

}  // namespace fcl_fibers::scenes

#include <fmt/core.h>

#include <bit>
#include <cstring>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats/colmap_model.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "COLMAP's files are little-endian");

// Reads consecutive numbers; every read is checked against the end of the file.
class Cursor {
 public:
  explicit Cursor(const fs::path& path) : name_(path.filename().string()), bytes_(ReadFile(path)) {}

  const std::string& name() const { return name_; }
  size_t Left() const { return bytes_.size() - at_; }

  template <typename T>
  T Read() {
    Need(sizeof(T));
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  template <typename T, size_t n>
  void ReadInto(T (&values)[n]) {
    for (T& v : values) v = Read<T>();
  }
  std::string ReadName() {
    const size_t end = bytes_.find('\0', at_);
    if (end == std::string::npos) Need(bytes_.size() + 1);
    std::string text = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    return text;
  }
  // Reads a number of records of at least `record_bytes`, which must fit into the rest of the file.
  uint64_t ReadCount(size_t record_bytes, const std::string& what) {
    const uint64_t count = Read<uint64_t>();
    if (count > Left() / record_bytes) {
      throw InvalidArgument("{} is truncated or damaged: it claims {} {} but {} bytes are left",
                            name_,
                            count,
                            what,
                            Left());
    }
    return count;
  }

 private:
  void Need(size_t count) {
    if (count > Left()) {
      throw InvalidArgument(
          "{} is truncated at byte {}; copy the model again", name_, bytes_.size());
    }
  }

  std::string name_;
  std::string bytes_;
  size_t at_ = 0;
};

std::map<uint32_t, ColmapCamera> ReadCameras(const fs::path& path) {
  Cursor cursor(path);
  std::map<uint32_t, ColmapCamera> cameras;
  const uint64_t count = cursor.ReadCount(24, "cameras");
  for (uint64_t i = 0; i < count; ++i) {
    const uint32_t id = cursor.Read<uint32_t>();
    const std::string place = fmt::format("{}: camera {}", cursor.name(), id);
    const std::string model = ColmapModelName(cursor.Read<int32_t>(), place);
    const uint64_t width = cursor.Read<uint64_t>();
    const uint64_t height = cursor.Read<uint64_t>();
    std::vector<double> parameters(static_cast<size_t>(ColmapParameterCount(model, place)));
    for (double& p : parameters) p = cursor.Read<double>();
    if (!cameras.emplace(id, MakeColmapCamera(model, width, height, parameters, place)).second) {
      throw InvalidArgument("{} appears twice", place);
    }
  }
  return cameras;
}

std::map<uint32_t, ColmapImage> ReadImages(const fs::path& path) {
  Cursor cursor(path);
  std::map<uint32_t, ColmapImage> images;
  const uint64_t count = cursor.ReadCount(73, "images");
  for (uint64_t i = 0; i < count; ++i) {
    const uint32_t id = cursor.Read<uint32_t>();
    double qvec[4];
    double tvec[3];
    cursor.ReadInto(qvec);
    cursor.ReadInto(tvec);
    ColmapImage image;
    image.camera_id = cursor.Read<uint32_t>();
    image.name = cursor.ReadName();
    CheckColmapName(image.name, cursor.name());
    const std::string place = cursor.name() + ": image " + image.name;
    image.cam_from_world = MakeColmapPose(qvec, tvec, place);
    const uint64_t observations = cursor.ReadCount(24, "observations of image " + image.name);
    image.observations.reserve(observations);
    for (uint64_t k = 0; k < observations; ++k) {
      ColmapObservation observation;
      observation.pixel.x() = cursor.Read<double>();
      observation.pixel.y() = cursor.Read<double>();
      observation.point_id = cursor.Read<int64_t>();
      image.observations.push_back(observation);
    }
    if (!images.emplace(id, std::move(image)).second) {
      throw InvalidArgument("{} has the same number as another one", place);
    }
  }
  return images;
}

std::vector<ColmapPoint> ReadPoints(const fs::path& path) {
  Cursor cursor(path);
  const uint64_t count = cursor.ReadCount(51, "points");
  std::vector<ColmapPoint> points;
  points.reserve(count);
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t id = cursor.Read<uint64_t>();
    ColmapPoint point;
    point.id = id;
    double xyz[3];
    cursor.ReadInto(xyz);
    point.position = Eigen::Vector3d(xyz[0], xyz[1], xyz[2]);
    uint8_t rgb[3];
    cursor.ReadInto(rgb);
    point.error_px = KnownError(cursor.Read<double>());
    CheckColmapPoint(point, fmt::format("{}: point {}", cursor.name(), id));
    const uint64_t track = cursor.ReadCount(8, "track elements");
    point.image_ids.reserve(track);
    for (uint64_t k = 0; k < track; ++k) {
      point.image_ids.push_back(cursor.Read<uint32_t>());
      cursor.Read<uint32_t>();  // index of the observation
    }
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace

ColmapModel LoadColmapBinary(const fs::path& folder) {
  return {ReadCameras(folder / "cameras.bin"),
          ReadImages(folder / "images.bin"),
          ReadPoints(folder / "points3D.bin")};
}

}  // namespace color3d

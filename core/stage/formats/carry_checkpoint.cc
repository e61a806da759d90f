#include "core/stage/formats/carry_checkpoint.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "core/catalogue/stages.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

using nlohmann::json;

namespace {

// First bytes of a checkpoint; records follow:
//   {"view": name, "coverage": 0..1, "png": bytes}       a finished view; the last one counts
//   {"key": name, "direction": 1 or -1, "frame": name, "moved": longer sides,
//    "wanted": 0..1, "width": px, "height": px, "in_key": bytes, "in_frame": bytes}
//                                                        a walk of a film; without maps at its end
constexpr char kMagic[] = "carry 3\n";

json::binary_t BytesOf(const Image& map) {
  std::vector<uint8_t> bytes(map.data.size() * sizeof(float));
  std::memcpy(bytes.data(), map.data.data(), bytes.size());
  return json::binary_t(std::move(bytes));
}

Image MapFrom(const json& record, const char* name) {
  Image map(record.at("width").get<int>(), record.at("height").get<int>(), 2);
  const json::binary_t& bytes = record.at(name).get_binary();
  if (bytes.size() != map.data.size() * sizeof(float)) {
    throw Error(ErrorCode::kDataLoss, "{} has {} bytes", name, bytes.size());
  }
  std::memcpy(map.data.data(), bytes.data(), bytes.size());
  return map;
}

json RecordOf(const FilmWalk& walk, const Scene& scene) {
  json record{{"key", scene.views[walk.key].name},
              {"direction", walk.direction},
              {"frame", scene.views[walk.frame].name},
              {"moved", walk.moved},
              {"wanted", walk.wanted}};
  if (walk.track) {
    record["width"] = walk.track->in_key.width;
    record["height"] = walk.track->in_key.height;
    record["in_key"] = json(BytesOf(walk.track->in_key));
    record["in_frame"] = json(BytesOf(walk.track->in_frame));
  }
  return record;
}

FilmWalk WalkFrom(const json& record, const Scene& scene) {
  FilmWalk walk;
  walk.key = scene.FindView(record.at("key").get<std::string>());
  walk.direction = record.at("direction");
  walk.frame = scene.FindView(record.at("frame").get<std::string>());
  walk.moved = record.at("moved");
  walk.wanted = record.at("wanted");
  if (record.contains("in_key")) {
    walk.track = std::make_shared<const FilmTrack>(
        FilmTrack{MapFrom(record, "in_key"), MapFrom(record, "in_frame")});
  }
  return walk;
}

void CheckRecord(const json& record, const Scene& scene) {
  if (record.contains("key")) {
    WalkFrom(record, scene);
    return;
  }
  scene.FindView(record.at("view").get<std::string>());
  record.at("coverage").get<double>();
  record.at("png").get_binary();
}

}  // namespace

CarryCheckpoint::CarryCheckpoint(const Scene& scene, StageContext& context)
    : scene_(scene),
      context_(context),
      was_done_(scene.views.size(), 0),
      coverage_(scene.views.size(), 0.0),
      is_done_(scene.views.size(), 0),
      records_(kind::kCarryColor, kMagic, context) {
  records_.Restore([&](const json& record) { CheckRecord(record, scene_); },
                   [&](const json& record) {
                     const MutexLock lock(mutex_);
                     Restore(record);
                   });
}

void CarryCheckpoint::Restore(const json& record) {
  if (record.contains("key")) {
    const FilmWalk walk = WalkFrom(record, scene_);
    walks_[{walk.key, walk.direction}] = walk;
    return;
  }
  const auto view = static_cast<size_t>(scene_.FindView(record.at("view").get<std::string>()));
  const json::binary_t& png = record.at("png").get_binary();
  Keep(view, record.at("coverage"), std::string(png.begin(), png.end()));
  was_done_[view] = 1;
}

void CarryCheckpoint::Keep(size_t view, double coverage, const std::string& png) {
  const std::string name = ViewArtifact(artifact::kCarried, scene_.views[view]);
  if (is_done_[view] != 0) {
    context_.RewriteOutput(name, png);
  } else {
    context_.WriteOutput(name, png);
    is_done_[view] = 1;
    ++done_;
  }
  coverage_[view] = coverage;
  records_.Append({{"view", scene_.views[view].name},
                   {"coverage", coverage},
                   {"png", json::binary(std::vector<uint8_t>(png.begin(), png.end()))}});
}

void CarryCheckpoint::Add(int view, double coverage, const std::string& png) {
  const MutexLock lock(mutex_);
  const auto index = static_cast<size_t>(view);
  Keep(index, coverage, png);
  context_.ReportProgress(
      done_, std::ssize(scene_.views), "carrying colour into " + scene_.views[index].name);
  SaveWhenDue();
}

void CarryCheckpoint::ReportProgress(const std::string& message) const {
  const MutexLock lock(mutex_);
  context_.ReportProgress(done_, std::ssize(scene_.views), message);
}

std::string CarryCheckpoint::Png(int view) const {
  return context_.ReadOutput(ViewArtifact(artifact::kCarried, scene_.views[view]));
}

void CarryCheckpoint::Replace(int view, double coverage, const std::string& png) {
  const MutexLock lock(mutex_);
  Keep(static_cast<size_t>(view), coverage, png);
  SaveWhenDue();
}

void CarryCheckpoint::SaveWhenDue() {
  records_.SaveWhenDue([this]() COLOR3D_REQUIRES(mutex_) {
    std::vector<json> walks;
    for (const auto& [place, walk] : walks_) walks.push_back(RecordOf(walk, scene_));
    return walks;
  });
}

std::vector<FilmWalk> CarryCheckpoint::Walks() const {
  const MutexLock lock(mutex_);
  std::vector<FilmWalk> walks;
  for (const auto& [place, walk] : walks_) walks.push_back(walk);
  return walks;
}

void CarryCheckpoint::SetWalk(const FilmWalk& walk) {
  const MutexLock lock(mutex_);
  walks_[{walk.key, walk.direction}] = walk;
}

}  // namespace color3d

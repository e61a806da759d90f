#include "core/stage/formats/carry_checkpoint.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>

#include "core/catalogue/stages.h"
#include "core/stage/formats/artifacts.h"

namespace color3d {

using nlohmann::json;

namespace {

// A checkpoint: these bytes, then records: length (uint64) and CBOR of
//   {"view": name, "coverage": 0..1, "png": bytes}       a view that is done
//   {"key": name, "direction": 1 or -1, "frame": name, "width": px, "height": px,
//    "in_key": bytes, "in_frame": bytes}                 a walk of a film; neither at its end
constexpr std::string_view kMagic = "carry 2\n";

void Append(std::ostream& out, const json& record) {
  std::string bytes;
  json::to_cbor(record, bytes);
  const uint64_t length = bytes.size();
  out.write(reinterpret_cast<const char*>(&length), sizeof(length));
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Throws json::exception or Error{kDataLoss}.
void ForEachRecord(const std::filesystem::path& file,
                   const std::function<void(const json&)>& on_record) {
  const Error damaged(ErrorCode::kDataLoss, "it ends too soon");
  std::ifstream in(file, std::ios::binary);
  uint64_t left = std::filesystem::file_size(file);
  std::string bytes(kMagic.size(), '\0');
  if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())) || bytes != kMagic) {
    throw Error(ErrorCode::kDataLoss, "it is none of this version");
  }
  left -= bytes.size();
  while (left > 0) {
    uint64_t length = 0;
    if (left < sizeof(length)) throw damaged;
    in.read(reinterpret_cast<char*>(&length), sizeof(length));
    left -= sizeof(length);
    if (length > left) throw damaged;
    bytes.resize(length);
    if (!in.read(bytes.data(), static_cast<std::streamsize>(length))) throw damaged;
    left -= length;
    on_record(json::from_cbor(bytes));
  }
}

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
              {"frame", scene.views[walk.frame].name}};
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
      file_(FileOf("carried"), std::ios::binary | std::ios::trunc) {
  file_ << kMagic;
  const std::filesystem::path before = FileOf("before");
  try {
    if (context.checkpoints().LoadTo(before)) TakeUp(before);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kDataLoss && e.code() != ErrorCode::kNotFound) throw;
    context.progress().OnWarning(fmt::format(
        "{} starts afresh: its checkpoint is damaged ({})", kind::kCarryColor, e.what()));
  }
  std::filesystem::remove(before);
}

// All of it or nothing.
void CarryCheckpoint::TakeUp(const std::filesystem::path& file) {
  try {
    ForEachRecord(file, [&](const json& record) { CheckRecord(record, scene_); });
  } catch (const json::exception& e) {
    throw Error(ErrorCode::kDataLoss, "{}", e.what());
  }
  ForEachRecord(file, [&](const json& record) { TakeUp(record); });
}

void CarryCheckpoint::TakeUp(const json& record) {
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
  context_.WriteOutput(ViewArtifact(artifact::kCarried, scene_.views[view], ".png"), png);
  coverage_[view] = coverage;
  ++done_;
  Append(file_,
         {{"view", scene_.views[view].name},
          {"coverage", coverage},
          {"png", json::binary(std::vector<uint8_t>(png.begin(), png.end()))}});
}

void CarryCheckpoint::Add(int view, double coverage, const std::string& png) {
  const std::lock_guard lock(mutex_);
  const auto index = static_cast<size_t>(view);
  Keep(index, coverage, png);
  context_.progress().OnProgress(done_,
                                 static_cast<int64_t>(scene_.views.size()),
                                 "carrying colour into " + scene_.views[index].name);
  if (context_.checkpoints().WantsSave()) Save();
}

std::vector<FilmWalk> CarryCheckpoint::Walks() const {
  const std::lock_guard lock(mutex_);
  std::vector<FilmWalk> walks;
  for (const auto& [place, walk] : walks_) walks.push_back(walk);
  return walks;
}

void CarryCheckpoint::SetWalk(const FilmWalk& walk) {
  const std::lock_guard lock(mutex_);
  walks_[{walk.key, walk.direction}] = walk;
}

void CarryCheckpoint::Save() {
  const std::filesystem::path file = FileOf("save");
  file_.flush();
  std::filesystem::copy_file(
      FileOf("carried"), file, std::filesystem::copy_options::overwrite_existing);
  {
    std::ofstream out(file, std::ios::binary | std::ios::app);
    for (const auto& [place, walk] : walks_) Append(out, RecordOf(walk, scene_));
    if (!file_ || !out.flush()) {
      throw Error(ErrorCode::kResourceExhausted,
                  "cannot write the checkpoint {}; is the disk full?",
                  file.string());
    }
  }
  context_.checkpoints().SaveFile(file);
}

std::filesystem::path CarryCheckpoint::FileOf(const char* name) const {
  return context_.scratch_folder() / fmt::format("carry_checkpoint.{}", name);
}

}  // namespace color3d

#include "core/stage/formats/carry_checkpoint.h"

#include <fmt/format.h>

#include <cstdint>
#include <optional>

#include "core/catalogue/stages.h"
#include "core/stage/formats/artifacts.h"

namespace color3d {

using nlohmann::json;

namespace {

struct Done {
  size_t view = 0;
  double coverage = 0.0;
  std::string png;
};

std::vector<Done> Parse(const std::string& state, const Scene& scene) {
  const json views = json::from_cbor(state);
  std::vector<Done> done;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    const auto found = views.find(scene.views[i].name);
    if (found == views.end()) continue;
    const json::binary_t& png = found->at(1).get_binary();
    done.push_back({i, found->at(0).get<double>(), std::string(png.begin(), png.end())});
  }
  return done;
}

}  // namespace

CarryCheckpoint::CarryCheckpoint(const Scene& scene, StageContext& context)
    : scene_(scene),
      context_(context),
      was_done_(scene.views.size(), 0),
      coverage_(scene.views.size(), 0.0) {
  const std::optional<std::string> state = context.checkpoints().Load();
  if (!state) return;
  std::vector<Done> done;
  try {
    done = Parse(*state, scene);
  } catch (const json::exception& e) {
    context.progress().OnWarning(fmt::format(
        "{} starts afresh: its checkpoint is damaged ({})", kind::kCarryColor, e.what()));
  }
  for (const Done& one : done) {
    Keep(one.view, one.coverage, one.png);
    was_done_[one.view] = 1;
  }
}

void CarryCheckpoint::Keep(size_t view, double coverage, const std::string& png) {
  context_.WriteOutput(ViewArtifact(artifact::kCarried, scene_.views[view], ".png"), png);
  coverage_[view] = coverage;
  state_[scene_.views[view].name] = {coverage,
                                     json::binary(std::vector<uint8_t>(png.begin(), png.end()))};
}

void CarryCheckpoint::Add(int view, double coverage, const std::string& png) {
  const std::lock_guard lock(mutex_);
  const auto index = static_cast<size_t>(view);
  Keep(index, coverage, png);
  context_.progress().OnProgress(static_cast<int64_t>(state_.size()),
                                 static_cast<int64_t>(scene_.views.size()),
                                 "carrying colour into " + scene_.views[index].name);
  if (!context_.checkpoints().WantsSave()) return;
  std::string bytes;
  json::to_cbor(state_, bytes);
  context_.checkpoints().Save(bytes);
}

}  // namespace color3d

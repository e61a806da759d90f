#include "core/stage/formats/views_checkpoint.h"

#include <nlohmann/json.hpp>

#include "core/catalogue/stages.h"
#include "core/image/codec.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

using nlohmann::json;

namespace {

// First bytes of a checkpoint; records follow: {"view": name, "ab": bytes, "provenance": bytes},
// PNG.
constexpr char kMagic[] = "views 1\n";

std::string BytesAt(const json& record, const char* name) {
  const json::binary_t& bytes = record.at(name).get_binary();
  return {bytes.begin(), bytes.end()};
}

json Binary(const std::string& bytes) {
  return json::binary(std::vector<uint8_t>(bytes.begin(), bytes.end()));
}

}  // namespace

ViewsCheckpoint::ViewsCheckpoint(const Scene& scene, StageContext& context)
    : scene_(scene),
      context_(context),
      was_done_(scene.views.size(), 0),
      records_(kind::kColorizeViews, kMagic, context) {
  const auto view_of = [&](const json& record) {
    return scene.FindView(record.at("view").get<std::string>());
  };
  records_.Restore(
      [&](const json& record) {
        view_of(record);
        record.at("ab").get_binary();
        record.at("provenance").get_binary();
      },
      [&](const json& record) {
        const int view = view_of(record);
        const MutexLock lock(mutex_);
        Keep(view, BytesAt(record, "ab"), BytesAt(record, "provenance"));
        was_done_[static_cast<size_t>(view)] = 1;
      });
}

void ViewsCheckpoint::Add(int view, const FusedColor& color) {
  const std::string ab = EncodeAbPng(color.ab);
  const std::string provenance = EncodePng8(color.provenance);
  const MutexLock lock(mutex_);
  Keep(view, ab, provenance);
  context_.ReportProgress(done_, std::ssize(scene_.views), "colouring " + scene_.views[view].name);
  records_.SaveWhenDue();
}

void ViewsCheckpoint::Keep(int view, const std::string& ab, const std::string& provenance) {
  context_.WriteOutput(ViewArtifact(artifact::kViewsAb, scene_.views[view]), ab);
  context_.WriteOutput(ViewArtifact(artifact::kProvenance, scene_.views[view]), provenance);
  ++done_;
  records_.Append(
      {{"view", scene_.views[view].name}, {"ab", Binary(ab)}, {"provenance", Binary(provenance)}});
}

}  // namespace color3d

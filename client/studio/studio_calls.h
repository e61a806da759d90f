// What the page asks of the service, one function each: the same calls as the commands make.
// Thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"
#include "client/studio/color_choice.h"
#include "client/studio/kept_blobs.h"
#include "client/studio/photo_sets.h"
#include "client/studio/shared_connection.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// What the page chose for a run.
struct RunChoices {
  std::string preset = "fast";
  KeyChoice key;
  // More photos that the user coloured, the most important first.
  std::vector<KeyChoice> further;
  double time_budget_seconds = 0.0;  // 0: none
  bool poses = false;                // films: also a scene in 3D
};

class StudioCalls {
 public:
  // `connection` must outlive the calls.
  explicit StudioCalls(SharedConnection& connection) : connection_(connection) {}

  nlohmann::ordered_json ServerFacts() const;
  nlohmann::ordered_json Plan(const PhotoFolder& folder, const RunChoices& choices) const;
  // Uploads what the service lacks. Returns "scenes/...".
  std::string Upload(const PhotoFolder& folder) const;

  // Submits the selection of the key view. `count`: views chosen together, each with the error that
  // is expected with it and those before it.
  v1::Job SelectKeyView(const std::string& scene, int count) const;
  // view, description, views (name, expected_error or null, saves) and ranking of a selection that
  // has succeeded.
  nlohmann::ordered_json KeyViews(const std::string& job) const;

  v1::Job Colorize(const std::string& scene, const RunChoices& choices) const;
  v1::Job Cancel(const std::string& job) const;
  v1::Job Retry(const std::string& job) const;
  v1::Job Job(const std::string& job) const;
  // Jobs of coloured scenes, the newest first, at most 100; of versions of a scene the newest.
  nlohmann::ordered_json Jobs() const;

  // Passes the state of the job (RunProgress::ToJson) to `send` now and after each change, at most
  // four times a second, until it has ended or `send` returns false. `send` gets an empty text if
  // nothing has changed for a while.
  void Watch(const std::string& job, const std::function<bool(const std::string&)>& send) const;

  // Writes an artifact to `file`, unless it is there. Returns its media type.
  std::string Fetch(const std::string& job,
                    const std::string& artifact,
                    const std::filesystem::path& file) const;

  // Colours a photo at screen size as PNG, from the coloured key view of a run.
  std::string PreviewOfRun(const std::string& job, const LocalFile& photo, int max_side_px) const;
  // Colours a photo from a choice as PNG, at most `max_side_px` on its longer side; 0: at full
  // size, exactly as a run does. kReference and kWords need `made_by`, the job of ColorBelow.
  std::string Preview(const LocalFile& photo,
                      const ColorChoice& color,
                      const std::string& made_by,
                      int max_side_px) const;
  // Submits the colouring of one photo without its strokes.
  v1::Job ColorBelow(const std::string& scene,
                     const std::string& view,
                     const ColorChoice& color) const;

 private:
  SharedConnection& connection_;
  mutable KeptBlobs blobs_;
};

}  // namespace color3d::client

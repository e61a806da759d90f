// What the page asks of the service, one function each: the same calls as the commands make.
// Thread-safe; each function makes its own connection, so that a server that ended is found or
// started again.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "client/lib/photos/photo_folder.h"
#include "client/studio/photo_sets.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// What the page chose for a run.
struct RunChoices {
  std::string preset = "fast";
  std::string key_view;              // empty: the service selects it
  bool automatic = true;             // else `picture`
  std::filesystem::path picture;     // a coloured key view, or its strokes
  bool is_strokes = false;           // `picture` holds points as JSON, as for `key color --hints`
  double time_budget_seconds = 0.0;  // 0: none
  bool poses = false;                // films: also a scene in 3D
  // More photos that the user coloured, the most important first: their key views and colours.
  std::vector<RunChoices> further;
};

class StudioCalls {
 public:
  StudioCalls(ServerTarget server, const CancellationToken& cancel)
      : server_(std::move(server)), cancel_(cancel) {}

  Connection Connect() const { return Connection(server_, cancel_); }

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
  // The same from strokes on this photo (JSON of `key color --hints`, px of the whole photo).
  std::string PreviewOfStrokes(const LocalFile& photo,
                               const std::string& strokes,
                               int max_side_px) const;

 private:
  const ServerTarget server_;
  const CancellationToken& cancel_;
};

}  // namespace color3d::client

// What the page asks of the service for films. A film's job is described by the whole list of its
// key frames and of its parts in other colours, so that one call adds, moves and removes them.
// Thread-safe, as StudioCalls.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/studio/studio_calls.h"

namespace color3d::client {

// A coloured frame, as the page wants it.
struct FilmFrameColor {
  KeyChoice key;
  // One of the job that is changed: the number in its list. `key` is then unused.
  std::optional<int> kept;
  // Seconds of the film; for parts in other colours only.
  std::optional<double> begin_s = {};
  std::optional<double> end_s = {};
};

struct FilmChoices {
  std::string preset = "fast";
  bool poses = false;  // also a scene in 3D that moves
  bool steady_exposure = false;
  double frames_per_second = 0.0;  // of films that are pictures; 0: the default
  // The first one is the key view; at least one for a new job.
  std::vector<FilmFrameColor> keys;
  std::vector<FilmFrameColor> parts;
};

// Reads choices of the page. Pictures and strokes are kept beside the set. Throws
// Error{kInvalidArgument} with the field.
FilmChoices ReadFilmChoices(const nlohmann::json& body, const std::string& set, PhotoSets& sets);

class FilmCalls {
 public:
  // `connection` must outlive the calls.
  explicit FilmCalls(SharedConnection& connection) : connection_(connection) {}

  // Of a job that selects key views or colours a film, as far as it has got: names, times (s) and
  // shots of the frames; coverage (share of each frame that key frames show, null if unknown), keys
  // (view, automatic), parts (view, begin_s, end_s) and next (view, error_now, error_with; or
  // null). All lists are empty before the import has ended.
  nlohmann::ordered_json Timeline(const std::string& job) const;

  v1::Job Colorize(const std::string& scene, const FilmChoices& choices) const;
  // Colours the film of a job again, with these lists in place of its own. Stages that do not
  // depend on a change are not repeated.
  v1::Job Change(const std::string& job, const FilmChoices& choices) const;

 private:
  SharedConnection& connection_;
};

}  // namespace color3d::client

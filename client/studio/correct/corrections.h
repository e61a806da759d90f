// Corrections of a finished scene: what its stages know about each photo, and jobs that change its
// colours. Runs of one scene that differ in their corrections and in its tone alone are versions of
// each other, whoever submitted them; the newest one counts. Thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "client/studio/correct/versions.h"
#include "client/studio/shared_connection.h"
#include "color3d/v1/job.pb.h"
#include "core/base/files.h"
#include "core/base/mutex.h"

namespace color3d::client {

class SceneViews;

class Corrections {
 public:
  // `connection` must outlive the corrections.
  explicit Corrections(SharedConnection& connection) : connection_(connection) {}

  // key, views (SceneViews::Facts), has_sources, tone (saturation, tint, warmth) and corrections
  // (id, view, strokes or null) of a run. Throws Error{kFailedPrecondition} for runs that cannot be
  // corrected here: not finished, films, scenes that move or without photos.
  nlohmann::ordered_json Describe(const std::string& run);
  std::string PhotoJpeg(const std::string& run, const std::string& view, int side);

  enum class Map {
    kColor,   // R, G: (a, b + 128) / 255
    kBase,    // the same without any correction
    kSource,  // R guessed, G seen, B inferred
    kPull,    // grey: what the last correction touches
  };
  // PNG of 8 bits. `trial`: a job of Try whose maps are wanted; empty: the run's own. Throws
  // Error{kNotFound} if there is no such map.
  std::string MapPng(
      const std::string& run, const std::string& trial, Map map, const std::string& view, int side);

  // A change of the newest version: {add: {view, strokes, reach}, remove: [id], tone: {saturation,
  // tint, warmth}}, each optional. Strokes as for SceneViews::CapturedStrokes; reach as in
  // core/keycolor/hints/hints.h.
  // Try submits the correction stage alone, whose maps show what Change would do; Change then goes
  // on from its result. Throws Error{kFailedPrecondition} if no correction is left.
  v1::Job Try(const std::string& run, const nlohmann::json& change);
  // Submits a new version. One that is still worked on is cancelled.
  v1::Job Change(const std::string& run, const nlohmann::json& change);

  // Passes {newest: job or null, working: job or null} of the versions of the run to `send` now and
  // after each change, until `send` returns false; it gets an empty text if nothing has changed for
  // a while.
  void Watch(const std::string& run, const std::function<bool(const std::string&)>& send);

 private:
  // A finished run with its stages.
  struct Run {
    v1::Job job;
    std::vector<v1::Job> stages;  // also those that the run was given, the last ones first
    std::string key_view;
    std::shared_ptr<const SceneViews> views;
  };
  std::shared_ptr<const Run> Open(const std::string& run);
  std::shared_ptr<const SceneViews> OpenViews(Connection& connection,
                                              const v1::Job& job,
                                              const v1::Artifact& scene);
  // Has the service keep what strokes on this scene need, once.
  void Prepare(Connection& connection, const Run& run);
  VersionChange ReadChange(Connection& connection, const Run& run, const nlohmann::json& change);
  v1::FurtherKeyView Uploaded(Connection& connection, const Run& run, const nlohmann::json& stroke);

  SharedConnection& connection_;
  const ScratchFolder files_;
  Mutex mutex_;
  CondVar changed_;
  int64_t changes_ COLOR3D_GUARDED_BY(mutex_) = 0;
  std::map<std::string, std::shared_ptr<const Run>> runs_ COLOR3D_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<const SceneViews>> views_ COLOR3D_GUARDED_BY(mutex_);
  std::set<std::string> prepared_ COLOR3D_GUARDED_BY(mutex_);  // colorizers
  Mutex submitting_;                                           // one change follows the other
};

}  // namespace color3d::client

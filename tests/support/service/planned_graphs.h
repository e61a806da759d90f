// Jobs to plan in tests, and the planned graphs.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/digest.h"
#include "server/base/service_error.h"
#include "server/planning/planner.h"

namespace color3d {

inline v1::Digest SomeDigest(const std::string& text) {
  v1::Digest digest;
  digest.set_sha256(Sha256Hex(text));
  digest.set_size_bytes(10);
  return digest;
}

inline constexpr SceneFacts kTwentyPhotos = {.pictures = 20, .layout = CaptureLayout::kColmap};

inline v1::JobSpec SceneSpec() {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = SomeDigest("key");
  return spec;
}

inline JobRecord Done(const std::string& kind) {
  JobRecord job;
  job.name = "jobs/" + kind;
  job.kind = kind;
  job.scene = "scenes/test";
  job.state = JobState::kSucceeded;
  return job;
}

inline int IndexOf(const NewGraph& graph, const std::string& kind) {
  for (size_t i = 0; i < graph.jobs.size(); ++i) {
    if (graph.jobs[i].kind == kind) return static_cast<int>(i);
  }
  ADD_FAILURE() << "no " << kind;
  return 0;
}

inline v1::JobSpec SpecOf(const NewGraph& graph, const std::string& kind) {
  v1::JobSpec spec;
  EXPECT_TRUE(spec.ParseFromString(graph.jobs[IndexOf(graph, kind)].spec));
  return spec;
}

inline std::vector<std::string> InputKinds(const NewGraph& graph, const std::string& kind) {
  std::vector<std::string> kinds;
  for (const int input : graph.jobs[IndexOf(graph, kind)].inputs) {
    kinds.push_back(graph.jobs[input].kind);
  }
  return kinds;
}

struct Thrown {
  std::string reason = "nothing";
  std::string message;
  ErrorCode code = ErrorCode::kInternal;
};
inline Thrown PlanError(const v1::JobSpec& spec, const std::vector<JobRecord>& inputs = {}) {
  try {
    PlanJob(spec, inputs, kTwentyPhotos);
  } catch (const Error& e) {
    return {ReasonOf(e), e.what(), e.code()};
  }
  return {};
}

}  // namespace color3d

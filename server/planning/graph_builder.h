// Puts the jobs of one submission together into a graph: each depends on the jobs whose artifacts
// its stage reads, as the catalogue of stages says. Pure: no store, no clock.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/store/job_store.h"

namespace color3d {

class GraphBuilder {
 public:
  // Fills in what the user left open in a stage's options.
  using FillUnset = std::function<void(v1::JobSpec*)>;

  // `submitted` must outlive the builder. `inputs`: the jobs that it names, with their children;
  // jobs that coloured additional key views are passed over. Throws Error{kInvalidArgument} for
  // inputs of another scene and for two jobs of one kind.
  GraphBuilder(const v1::JobSpec& submitted,
               const std::vector<JobRecord>& inputs,
               FillUnset fill_unset);

  // A spec with the submitted job's scene, seed and cache policy, and this stage without options.
  v1::JobSpec StageSpec(const std::string& kind) const;

  // The inputs by kind.
  const std::map<std::string, JobRecord>& given() const { return given_; }

  // Appends the job, skipped when there is a reason to. What its stage needs comes from earlier
  // jobs of the graph, then from given inputs, then, where the submitted stage may bring them
  // along, from jobs that are added for it; what it only reads when it is there, from the first
  // two. Each additional key view in its options is coloured by a job that is appended before it.
  // Throws ServiceError INPUT_MISSING naming an artifact that nothing provides.
  void Add(v1::JobSpec spec, const std::string& skip_reason = "");

  // Appends the submitted job as the parent of all others: it waits for them and for the inputs.
  void AddParent();

  NewGraph Take() { return std::move(graph_); }

 private:
  // Appends the colorize_key_view job of an additional key view and returns its position.
  int AddKeyView(const v1::FurtherKeyView& view);
  void Provide(const std::string& artifact, const std::string& for_kind, NewJob* job);
  void LinkIfThere(const std::string& provider, NewJob* job) const;

  const v1::JobSpec& submitted_;
  const std::string submitted_kind_;
  const FillUnset fill_unset_;
  std::map<std::string, JobRecord> given_;  // by kind
  std::map<std::string, int> planned_;      // by kind: positions in graph_.jobs
  NewGraph graph_;
};

}  // namespace color3d

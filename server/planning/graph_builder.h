// Builds the graph of jobs of one submission: each job depends on the jobs whose artifacts its
// stage reads (core/catalogue/stages.h). Uses no store and no clock. Not thread-safe.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/store/client_store.h"

namespace color3d {

class GraphBuilder {
 public:
  // Sets options of a stage that the user left unset.
  using FillUnset = std::function<void(v1::JobSpec*)>;

  // `inputs`: the jobs that `submitted` names, with their children; jobs that coloured additional
  // key views are ignored. Requires: `submitted` has a seed and outlives the builder. Throws
  // Error{kInvalidArgument} for inputs of another scene and for two jobs of one kind.
  GraphBuilder(const v1::JobSpec& submitted,
               const std::vector<JobRecord>& inputs,
               FillUnset fill_unset);

  // Returns a spec with the scene, the seed and the cache policy of the submitted job, and this
  // stage without options.
  v1::JobSpec StageSpec(const std::string& kind) const;

  // The inputs by kind.
  const std::map<std::string, JobRecord>& given() const { return given_; }

  // Appends a job, skipped if there is a reason. Artifacts that its stage needs come from earlier
  // jobs of the graph, else from inputs, else, if the submitted stage brings prerequisites, from
  // jobs that are added; artifacts that it only reads, from the first two. A job is appended before
  // it for each additional key view in its options. Throws ServiceError INPUT_MISSING with an
  // artifact that nothing provides.
  void Add(v1::JobSpec spec, const std::string& skip_reason = "");

  // Appends a job that colours each of these additional key views. The jobs that train the
  // colorizer and that colour the views, if added later, depend on them.
  void AddJointKeyViews(const google::protobuf::RepeatedPtrField<v1::FurtherKeyView>& views);

  // Appends the submitted job as the parent of all others. It depends on them and on the inputs.
  void AddParent();

  NewGraph Take() { return std::move(graph_); }

 private:
  // Appends the job with its options and returns its position.
  int Append(NewJob job, const v1::JobSpec& spec);
  // Appends the colorize_key_view job of an additional key view and returns its position.
  int AddKeyView(const v1::FurtherKeyView& view);
  void Provide(const std::string& artifact, const std::string& for_kind, NewJob* job);
  void LinkIfThere(const std::string& provider, NewJob* job) const;

  const v1::JobSpec& submitted_;
  const std::string submitted_kind_;
  const FillUnset fill_unset_;
  std::map<std::string, JobRecord> given_;  // by kind
  std::map<std::string, int> planned_;      // by kind: positions in graph_.jobs
  std::vector<int> joint_key_views_;        // positions in graph_.jobs
  NewGraph graph_;
};

}  // namespace color3d

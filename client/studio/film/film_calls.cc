#include "client/studio/film/film_calls.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/options/colorize_options.h"
#include "client/options/key_color_flags.h"
#include "client/studio/studio_requests.h"
#include "core/base/error.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostEntries = 64;

// ---- what the page says ------------------------------------------------------------------------
std::optional<double> SecondsOf(const nlohmann::json& entry, const char* field) {
  const auto value = entry.find(field);
  if (value == entry.end() || value->is_null()) return std::nullopt;
  if (!value->is_number() || value->get<double>() < 0.0) {
    throw InvalidArgument("{} is not a time of the film in seconds", field);
  }
  return value->get<double>();
}

FilmFrameColor ReadFrameColor(const nlohmann::json& entry,
                              const std::string& set,
                              PhotoSets& sets) {
  if (!entry.is_object()) throw InvalidArgument("a frame of the film is not a JSON object");
  FilmFrameColor frame;
  frame.begin_s = SecondsOf(entry, "begin_s");
  frame.end_s = SecondsOf(entry, "end_s");
  const auto kept = entry.find("kept");
  if (kept != entry.end()) {
    if (!kept->is_number_unsigned()) throw InvalidArgument("kept is not the number of a frame");
    frame.kept = kept->get<int>();
    return frame;
  }
  frame.key = ReadKey(entry, set, sets);
  frame.key.view = TextOf(entry, "view");
  if (frame.key.view.empty()) throw InvalidArgument("choose the frame that the colours belong to");
  return frame;
}

std::vector<FilmFrameColor> ReadFrames(const nlohmann::json& body,
                                       const char* field,
                                       const std::string& set,
                                       PhotoSets& sets) {
  std::vector<FilmFrameColor> frames;
  const auto list = body.find(field);
  if (list == body.end()) return frames;
  if (!list->is_array() || list->size() > kMostEntries) {
    throw InvalidArgument("{} is not a list of at most {} frames", field, kMostEntries);
  }
  for (const nlohmann::json& entry : *list) frames.push_back(ReadFrameColor(entry, set, sets));
  return frames;
}

// ---- what the service is asked -----------------------------------------------------------------
bool HasRange(const v1::FurtherKeyView& entry) { return entry.has_begin_s() || entry.has_end_s(); }

// Entries of the job in the order in which the page counts them.
struct FilmEntries {
  std::vector<v1::FurtherKeyView> keys;  // the key view first
  std::vector<v1::FurtherKeyView> parts;
};

FilmEntries EntriesOf(const v1::ColorizeSceneSpec& scene) {
  FilmEntries entries;
  v1::FurtherKeyView first;
  first.set_view(scene.key_view());
  *first.mutable_color() = scene.key_color();
  entries.keys.push_back(std::move(first));
  for (const v1::FurtherKeyView& key : scene.carry_color().further_key_views()) {
    (HasRange(key) ? entries.parts : entries.keys).push_back(key);
  }
  for (const v1::FurtherKeyView& part : scene.correct_colors().corrections()) {
    entries.parts.push_back(part);
  }
  return entries;
}

v1::FurtherKeyView MakeEntry(Connection& connection,
                             const FilmFrameColor& frame,
                             const std::vector<v1::FurtherKeyView>& before) {
  v1::FurtherKeyView entry;
  if (frame.kept) {
    if (*frame.kept >= std::ssize(before)) {
      throw InvalidArgument("this film has no coloured frame {}; reload the page", *frame.kept);
    }
    entry = before[*frame.kept];
    if (!frame.begin_s && !frame.end_s) return entry;
    entry.clear_begin_s();
    entry.clear_end_s();
  } else {
    entry.set_view(frame.key.view);
    *entry.mutable_color() = UploadColors(connection, frame.key.color, frame.key.strokes_file);
  }
  if (frame.begin_s) entry.set_begin_s(*frame.begin_s);
  if (frame.end_s) entry.set_end_s(*frame.end_s);
  return entry;
}

void SetEntries(Connection& connection,
                const FilmChoices& choices,
                const FilmEntries& before,
                v1::ColorizeSceneSpec* scene) {
  if (choices.keys.empty()) throw InvalidArgument("colour at least one frame of the film");
  FilmEntries after;
  for (const FilmFrameColor& key : choices.keys) {
    after.keys.push_back(MakeEntry(connection, key, before.keys));
  }
  for (const FilmFrameColor& part : choices.parts) {
    after.parts.push_back(MakeEntry(connection, part, before.parts));
    if (!HasRange(after.parts.back())) {
      throw InvalidArgument("say from when to when the colours of {} count",
                            after.parts.back().view());
    }
  }
  scene->set_key_view(after.keys.front().view());
  *scene->mutable_key_color() = after.keys.front().color();
  const bool had_more = scene->carry_color().further_key_views_size() > 0;
  if (had_more) scene->mutable_carry_color()->clear_further_key_views();
  for (size_t i = 1; i < after.keys.size(); ++i) {
    *scene->mutable_carry_color()->add_further_key_views() = after.keys[i];
  }
  if (after.parts.empty()) {
    scene->clear_correct_colors();
    return;
  }
  scene->mutable_correct_colors()->clear_corrections();
  for (const v1::FurtherKeyView& part : after.parts) {
    *scene->mutable_correct_colors()->add_corrections() = part;
  }
}

v1::JobSpec SpecOf(const FilmChoices& choices, const std::string& scene) {
  ColorizeOptions options;
  options.preset = choices.preset;
  options.poses = choices.poses;
  options.deflicker = choices.steady_exposure;
  v1::JobSpec spec = ColorizeSpec(options, scene);
  if (choices.frames_per_second > 0.0) {
    spec.mutable_colorize_scene()->mutable_import_scene()->set_film_frames_per_second(
        choices.frames_per_second);
  }
  return spec;
}

// ---- what the service knows --------------------------------------------------------------------
// The job, its stages and what they were made from.
std::vector<v1::Job> JobsAround(Connection& connection, const v1::Job& job) {
  std::vector<v1::Job> jobs = {job};
  std::set<std::string> known = {job.name()};
  for (v1::Job& child : ListChildren(connection, job.name())) {
    if (known.insert(child.name()).second) jobs.push_back(std::move(child));
  }
  for (size_t i = 0; i < jobs.size(); ++i) {
    const std::vector<std::string> inputs(jobs[i].spec().inputs().begin(),
                                          jobs[i].spec().inputs().end());
    for (const std::string& input : inputs) {
      if (known.insert(input).second) jobs.push_back(GetJob(connection, input));
    }
  }
  return jobs;
}

// A JSON artifact of the first of the jobs that has it; null if there is none yet.
Json FindJson(Connection& connection, const std::vector<v1::Job>& jobs, const char* name) {
  for (const v1::Job& job : jobs) {
    const bool has = std::ranges::any_of(
        job.artifacts(), [&](const v1::Artifact& artifact) { return artifact.name() == name; });
    if (!has) continue;
    return Json::parse(ReadArtifact(connection, job, name), nullptr, /*allow_exceptions=*/false);
  }
  return nullptr;
}

Json FrameJson(const v1::FurtherKeyView& entry) {
  const v1::KeyColorSource& color = entry.color();
  const bool has_strokes = color.backend_input().has_points();
  Json json = {{"view", entry.view()}, {"automatic", color.automatic() && !has_strokes}};
  json["begin_s"] = entry.has_begin_s() ? Json(entry.begin_s()) : Json();
  json["end_s"] = entry.has_end_s() ? Json(entry.end_s()) : Json();
  return json;
}

void AddFrames(const Json& scene, const Json& carried, Json* timeline) {
  std::map<std::string, double> covered;
  for (const Json& row : carried.is_object() ? carried.value("views", Json::array()) : Json()) {
    covered[row.value("view", "")] = row.value("coverage", 0.0);
  }
  struct Frame {
    double time_s;
    int shot;
    std::string name;
  };
  std::vector<Frame> frames;
  for (const Json& view : scene.is_object() ? scene.value("views", Json::array()) : Json()) {
    if (!view.contains("moment")) continue;
    const Json& moment = view["moment"];
    frames.push_back(
        {moment.value("time_s", 0.0), moment.value("shot", 0), view.value("name", "")});
  }
  std::ranges::stable_sort(frames, {}, &Frame::time_s);
  for (const Frame& frame : frames) {
    (*timeline)["names"].push_back(frame.name);
    (*timeline)["times"].push_back(frame.time_s);
    (*timeline)["shots"].push_back(frame.shot);
    const auto share = covered.find(frame.name);
    (*timeline)["coverage"].push_back(share == covered.end() ? Json() : Json(share->second));
  }
}

}  // namespace

FilmChoices ReadFilmChoices(const nlohmann::json& body, const std::string& set, PhotoSets& sets) {
  FilmChoices choices;
  choices.preset = PresetOf(body);
  choices.poses = FlagOf(body, "poses");
  choices.steady_exposure = FlagOf(body, "steady_exposure");
  const auto rate = body.find("frames_per_second");
  if (rate != body.end()) {
    if (!rate->is_number()) throw InvalidArgument("frames_per_second is not a number");
    choices.frames_per_second = rate->get<double>();
  }
  choices.keys = ReadFrames(body, "keys", set, sets);
  choices.parts = ReadFrames(body, "parts", set, sets);
  return choices;
}

Json FilmCalls::Timeline(const std::string& job) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job run = GetJob(connection, ResourceName(job, "jobs"));
  const std::vector<v1::Job> jobs = JobsAround(connection, run);
  Json timeline = {{"names", Json::array()},
                   {"times", Json::array()},
                   {"shots", Json::array()},
                   {"coverage", Json::array()},
                   {"keys", Json::array()},
                   {"parts", Json::array()},
                   {"next", nullptr},
                   {"poses", false}};
  AddFrames(FindJson(connection, jobs, artifact::kScene),
            FindJson(connection, jobs, artifact::kCarryFacts),
            &timeline);
  if (!run.spec().has_colorize_scene()) return timeline;
  const v1::ColorizeSceneSpec& scene = run.spec().colorize_scene();
  timeline["poses"] = scene.import_scene().film_poses() == v1::ImportSceneSpec::FILM_POSES_AUTO;
  FilmEntries entries = EntriesOf(scene);
  if (entries.keys.front().view().empty()) {
    const Json chosen = FindJson(connection, jobs, artifact::kKeyView);
    if (chosen.is_object()) entries.keys.front().set_view(chosen.value("view", ""));
  }
  for (const auto& key : entries.keys) timeline["keys"].push_back(FrameJson(key));
  for (const auto& part : entries.parts) timeline["parts"].push_back(FrameJson(part));
  const Json metrics = FindJson(connection, {run}, artifact::kMetrics);
  if (metrics.is_object() && metrics.contains("next_key_view")) {
    timeline["next"] = {{"view", metrics["next_key_view"]},
                        {"error_now", metrics.value("expected_error_now", 0.0)},
                        {"error_with", metrics.value("expected_error_with_next", 0.0)}};
  }
  return timeline;
}

v1::Job FilmCalls::Colorize(const std::string& scene, const FilmChoices& choices) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  v1::JobSpec spec = SpecOf(choices, ResourceName(scene, "scenes"));
  SetEntries(connection, choices, {}, spec.mutable_colorize_scene());
  return SubmitJob(connection, spec);
}

v1::Job FilmCalls::Change(const std::string& job, const FilmChoices& choices) const {
  const std::shared_ptr<Connection> kept = connection_.Get();
  Connection& connection = *kept;
  const v1::Job run = GetJob(connection, ResourceName(job, "jobs"));
  if (!run.spec().has_colorize_scene()) {
    throw Error(ErrorCode::kFailedPrecondition, "{} does not colour a film", run.name());
  }
  v1::JobSpec spec = run.spec();
  spec.set_skip_cache(false);
  SetEntries(connection, choices, EntriesOf(spec.colorize_scene()), spec.mutable_colorize_scene());
  return SubmitJob(connection, spec);
}

}  // namespace color3d::client

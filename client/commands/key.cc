// `color3d key`: selects, colours and accepts the key view before the long job starts.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/follow.h"
#include "client/commands/key_jobs.h"
#include "client/commands/results.h"
#include "client/commands/scene_target.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/options/colorize_options.h"
#include "client/options/key_color_flags.h"
#include "core/base/error.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/limits.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

struct KeyOptions {
  std::string target;  // folder or scenes/ID
  std::string out = "key_view";
  std::string view;
  std::string strategy;
  std::string encoder;   // name of weights in the configuration of the server
  std::string features;  // name of CLIP weights
  std::string job;
  int count = 1;           // number of key views chosen together
  bool film = false;       // the target is a folder of frames of a film
  ColorizeOptions import;  // options of the import only
  KeyColorFlags color;
};

class Key {
 public:
  Key(const Context& context, const KeyOptions& options)
      : context_(context),
        options_(options),
        display_(context.json),
        connection_(context.server, *context.interrupt) {}

  ExitCode Select();
  ExitCode Color();
  ExitCode Show();
  ExitCode Accept();

 private:
  std::string Scene() {
    return ResolveScene(connection_, context_, options_.target, options_.film, display_);
  }
  v1::JobSpec Spec(const std::string& scene) const {
    v1::JobSpec spec;
    spec.set_scene(scene);
    return spec;
  }
  bool HasImportOptions() const {
    return ImportSpec(options_.import, "").import_scene().ByteSizeLong() > 0;
  }
  // Submits the selection, with the import if options for it are given.
  v1::Job SubmitSelection(const std::string& scene);
  v1::Job Follow(const std::vector<std::string>& jobs) {
    return FollowToSuccess(connection_, context_, jobs, options_.out, display_);
  }
  // A job that was followed to its end, and its files in options_.out. Warnings of the import are
  // printed with those of its selection.
  struct Fetched {
    v1::Job job;
    KeyViewChoice choice;
    std::vector<std::string> files;
  };
  Fetched Fetch(const v1::Job& submitted) {
    std::vector<std::string> jobs = {submitted.name()};
    if (HasImportOptions()) {  // submitted with the selection
      jobs.insert(jobs.begin(), submitted.spec().inputs().begin(), submitted.spec().inputs().end());
    }
    const v1::Job job = Follow(jobs);
    return {job,
            ReadChoice(connection_, job),
            DownloadResults(connection_, context_, job, options_.out, display_)};
  }
  // Returns the jobs of the selection to colour: the requested one, else the newest.
  std::vector<std::string> SelectionFor(const std::string& scene);
  std::string Command(std::vector<std::string> arguments) const {
    return "  " + CommandLine(context_, std::move(arguments)) + "\n";
  }
  // Returns the commands that may follow, one a line.
  std::string NextCommands(const std::string& scene) const;

  const Context& context_;
  const KeyOptions& options_;
  ProgressDisplay display_;
  Connection connection_;
};

v1::Job Key::SubmitSelection(const std::string& scene) {
  v1::JobSpec spec = Spec(scene);
  v1::SelectKeyViewSpec* select = spec.mutable_select_key_view();
  if (!options_.view.empty()) {
    select->set_strategy(v1::SelectKeyViewSpec::STRATEGY_MANUAL);
    select->set_view(options_.view);
  } else if (options_.strategy == "entropy") {
    select->set_strategy(v1::SelectKeyViewSpec::STRATEGY_ENTROPY);
  } else if (options_.strategy == "tracks") {
    select->set_strategy(v1::SelectKeyViewSpec::STRATEGY_TRACKS);
  } else if (options_.strategy == "coverage") {
    select->set_strategy(v1::SelectKeyViewSpec::STRATEGY_COVERAGE);
  }
  if (options_.count > 1) select->set_count(options_.count);
  select->set_encoder(options_.encoder);
  select->set_features(options_.features);
  if (HasImportOptions()) {  // else the default import
    spec.add_inputs(SubmitJob(connection_, ImportSpec(options_.import, scene)).name());
  }
  return SubmitJob(connection_, spec);
}

std::string Key::NextCommands(const std::string& scene) const {
  std::vector<std::string> again = {"key", "select", scene, "--view", "NAME"};
  if (options_.import.hold_out) again.emplace_back("--hold-out");
  if (options_.import.deflicker) again.emplace_back("--deflicker");
  if (options_.import.poses) again.emplace_back("--poses");
  for (const std::string& setting : options_.import.settings) {
    again.insert(again.end(), {"--set", setting});
  }
  return "Colour it, for example\n" + Command({"key", "color", scene, "--auto"}) +
         Command({"key", "color", scene, "--image", "COLOURED.png"}) +
         Command({"key", "color", scene, "--hints", "STROKES.png"}) + "or choose another view\n" +
         Command(again);
}

ExitCode Key::Select() {
  PrepareOut(options_.out);
  const std::string scene = Scene();
  const v1::Job submitted = SubmitSelection(scene);
  const auto [job, choice, files] = Fetch(submitted);
  if (context_.json) {
    PrintJson({{"scene", scene},
               {"job", job.name()},
               {"key_view", choice.view},
               {"key_views", choice.views},
               {"description", choice.description},
               {"out", options_.out},
               {"files", files}});
    return ExitCode::kOk;
  }
  const fs::path out(options_.out);
  if (choice.views.size() > 1) {
    std::vector<std::string> command = {"colorize", "--scene", scene, "-o", "OUT"};
    command.insert(command.end(), {"--key-view", choice.view, "--key-color", "COLOURED.png"});
    for (size_t i = 1; i < choice.views.size(); ++i) {
      command.insert(command.end(), {"--add-key-view", choice.views[i] + "=COLOURED.png"});
    }
    PrintText(fmt::format("key views  {}\n           {}\nColour each, and pass them together\n{}",
                          fmt::join(choice.views, ", "),
                          choice.description,
                          Command(command)));
    return ExitCode::kOk;
  }
  PrintText(fmt::format("key view   {}\n           {}\nto colour  {}\nranking    {}\n{}",
                        choice.view,
                        choice.description,
                        (out / artifact::kKeyViewGray).string(),
                        (out / artifact::kKeyViewRanking).string(),
                        NextCommands(scene)));
  return ExitCode::kOk;
}

std::vector<std::string> Key::SelectionFor(const std::string& scene) {
  if (!options_.view.empty() || HasImportOptions()) {
    const v1::Job select = SubmitSelection(scene);
    return JobAndInputs(connection_, select);
  }
  const KeyState state = ReadKeyState(connection_, scene);
  if (state.selected) return JobAndInputs(connection_, *state.selected);
  return {};  // selected by the server
}

ExitCode Key::Color() {
  options_.color.Check();
  if (!options_.color.HasSource()) {
    throw InvalidArgument(
        "a source of colour is missing: --auto, --image, --hints, --reference, --prompt, "
        "--backend, --script or --edit");
  }
  PrepareOut(options_.out);
  const std::string scene = Scene();
  v1::JobSpec spec = Spec(scene);
  *spec.mutable_colorize_key_view()->mutable_source() = UploadKeyColor(connection_, options_.color);
  for (const std::string& input : SelectionFor(scene)) spec.add_inputs(input);
  const v1::Job submitted = SubmitJob(connection_, spec);
  const auto [job, choice, files] = Fetch(submitted);
  if (context_.json) {
    PrintJson({{"scene", scene},
               {"job", job.name()},
               {"key_view", choice.view},
               {"source", DescribeSource(job)},
               {"out", options_.out},
               {"files", files}});
    return ExitCode::kOk;
  }
  PrintText(
      fmt::format("key view   {}\ncolour     from {}\npicture    {}\nAccept it\n{}"
                  "or colour it again from another source: each result is kept.\n",
                  choice.view,
                  DescribeSource(job),
                  (fs::path(options_.out) / artifact::kKeyViewColored).string(),
                  Command({"key", "accept", scene})));
  return ExitCode::kOk;
}

ExitCode Key::Show() {
  const std::string scene = Scene();
  const KeyState state = ReadKeyState(connection_, scene);
  const auto name = [](const std::optional<v1::Job>& job) {
    return job ? nlohmann::ordered_json(job->name()) : nlohmann::ordered_json();
  };
  const v1::Job* newest = state.accepted   ? &*state.accepted
                          : state.colored  ? &*state.colored
                          : state.selected ? &*state.selected
                                           : nullptr;
  const KeyViewChoice choice =
      newest != nullptr ? ReadChoice(connection_, *newest) : KeyViewChoice{};
  if (context_.json) {
    PrintJson({{"scene", scene},
               {"key_view", choice.view},
               {"description", choice.description},
               {"selected", name(state.selected)},
               {"colored", name(state.colored)},
               {"accepted", name(state.accepted)}});
    return ExitCode::kOk;
  }
  if (newest == nullptr) {
    PrintText(scene + " has no key view yet: select one\n" + Command({"key", "select", scene}));
    return ExitCode::kOk;
  }
  std::string text = scene + "\nkey view   " + choice.view + "\n";
  if (!choice.description.empty()) text += "           " + choice.description + "\n";
  const auto line = [&](const char* label, const std::optional<v1::Job>& job) {
    text += std::string(label) + (job ? job->name() + ", from " + DescribeSource(*job) : "none");
    text += "\n";
  };
  line("coloured   ", state.colored);
  line("accepted   ", state.accepted);
  text += "download the pictures\n" +
          Command({"artifact", "download", newest->name(), "-o", options_.out});
  text += state.accepted
              ? "colour the scene\n" + Command({"colorize", "--scene", scene, "-o", "OUT"})
          : state.colored ? "accept the colour\n" + Command({"key", "accept", scene})
                          : NextCommands(scene);
  PrintText(text);
  return ExitCode::kOk;
}

ExitCode Key::Accept() {
  const std::string scene = Scene();
  std::string job = options_.job.empty() ? "" : ResourceName(options_.job, "jobs");
  if (job.empty()) {
    const KeyState state = ReadKeyState(connection_, scene);
    if (!state.colored) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "no key view of {} is coloured yet; first run `{}`",
                  scene,
                  CommandLine(context_, {"key", "color", scene, "--auto"}));
    }
    job = state.colored->name();
  }
  AcceptKeyColor(connection_, scene, job);
  const KeyViewChoice choice = ReadChoice(connection_, GetJob(connection_, job));
  if (context_.json) {
    PrintJson({{"scene", scene}, {"job", job}, {"key_view", choice.view}, {"accepted", true}});
  } else {
    PrintText(fmt::format("accepted {} as {} coloured it; now colour the scene\n{}",
                          choice.view,
                          job,
                          Command({"colorize", "--scene", scene, "-o", "OUT"})));
  }
  return ExitCode::kOk;
}

void AddTarget(CLI::App* command, KeyOptions* options) {
  command
      ->add_option(
          "SCENE",
          options->target,
          "scenes/ID, a folder of photos, a splat (.ply, .sog, .spz), or a film (.mp4, ...)")
      ->required();
  command->add_flag("--film", options->film, "Treat the photos as frames of a film");
}

void AddView(CLI::App* command, KeyOptions* options) {
  command->add_option("--view", options->view, "Name of the photo to use as the key view");
  DeclareImportOptions(*command, &options->import);
  command->add_option("-o,--out", options->out, "Folder for the pictures")->capture_default_str();
}

}  // namespace

void AddKeyCommands(CLI::App& app, Context& context) {
  CLI::App* key = app.add_subcommand("key", "Select, colour and accept the key view of a scene");
  key->require_subcommand(1)->fallthrough();
  const auto options = std::make_shared<KeyOptions>();
  const auto add = [&](const char* name, const char* help, ExitCode (Key::*action)()) {
    CLI::App* command = AddCommand(*key, context, name, help, [&context, options, action] {
      return (Key(context, *options).*action)();
    });
    AddTarget(command, options.get());
    return command;
  };

  CLI::App* select = add("select", "Select the photo to colour", &Key::Select);
  AddView(select, options.get());
  select->add_option("--strategy", options->strategy, "coverage (default), tracks or entropy")
      ->check(CLI::IsMember({"coverage", "tracks", "entropy"}));
  select
      ->add_option("--count",
                   options->count,
                   "Number of key views, chosen together for the least expected error; for films "
                   "one for each shot, the longest first")
      ->check(CLI::Range(1, kMaxAdditionalKeyViews + 1));
  select->add_option(
      "--encoder", options->encoder, "Encoder weights on the server to compare views with");
  select->add_option(
      "--features", options->features, "CLIP weights on the server to compare views with");

  CLI::App* color = add("color", "Colour the key view and download it", &Key::Color);
  color->alias("colour");
  AddView(color, options.get());
  DeclareKeyColorFlags(*color, &options->color);

  add("show", "Show the selected, coloured and accepted key view", &Key::Show);

  add("accept", "Accept the newest colours of the key view for the scene", &Key::Accept)
      ->add_option("--job", options->job, "Job whose colours to accept instead");
}

}  // namespace color3d::client

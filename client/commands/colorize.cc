#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "client/commands/benchmark.h"
#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/follow.h"
#include "client/commands/key_jobs.h"
#include "client/commands/plan.h"
#include "client/commands/results.h"
#include "client/commands/scene_target.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/photos/film_as_frames.h"
#include "client/lib/photos/mask_files.h"
#include "client/lib/plan_text.h"
#include "client/lib/text.h"
#include "client/options/colorize_options.h"
#include "client/options/credit_flags.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

class Colorize {
 public:
  Colorize(const Context& context, ColorizeOptions options, CreditFlags credit)
      : context_(context),
        options_(std::move(options)),
        credit_(std::move(credit)),
        out_(options_.out),
        display_(context.json) {}

  ExitCode Run() {
    options_.Check();
    credit_.credit.Validate();
    if (!options_.scene.empty()) return RunStored();
    folder_ = CollectPhotos(options_.photos, options_.film);
    if (!options_.masks.empty()) AddMasks(options_.masks, &folder_);
    if (options_.film) UsePhotosAsFrames(&folder_);
    const CaptureLayoutInfo& layout = InfoOf(folder_.Layout());
    if (options_.poses && layout.views != ViewSource::kFrames && folder_.camera_films.empty()) {
      throw InvalidArgument(
          "--poses is for films, and {} is not a film; poses of photos are always found (for "
          "frames as pictures add --film)",
          options_.photos);
    }
    const bool has_time_ranges = std::string_view(InfoOf(layout.kind).why_no_time_range).empty();
    if (!options_.key_view.empty()) RequirePhoto(folder_, options_.key_view);
    for (const std::string& text : options_.additional_key_views) {
      const AdditionalKeyView key = ParseAdditionalKeyView(text);
      RequirePhoto(folder_, key.view);
      if (key.HasRange() && (!has_time_ranges || options_.poses)) {
        throw InvalidArgument(
            "--add-key-view {}: a range of time is for films without poses; leave {} out",
            key.view,
            options_.poses ? "it or --poses" : "it");
      }
      if (!key.HasRange() && fs::path(key.view).replace_extension() ==
                                 fs::path(options_.key_view).replace_extension()) {
        throw InvalidArgument("--add-key-view {}: this is already the key view", key.view);
      }
    }
    RequireSeparateOutFolder(out_, folder_);
    RequireAugmentFiles(options_, folder_);
    if (!WantsAugmentFiles(options_) && !folder_.augment_files.empty()) {
      folder_.notes.push_back(
          fmt::format("the {} pictures in augment/ are not used for training; to use them, "
                      "add --augment-files",
                      folder_.augment_files.size()));
      // A benchmark uses no colours but the requested ones.
      if (options_.benchmark) folder_.augment_files.clear();
    }
    if (options_.benchmark && folder_.splat) {
      throw InvalidArgument("--benchmark needs photos in colour; {} is a splat",
                            folder_.splat->file.string());
    }
    if (options_.benchmark && !folder_.camera_films.empty()) {
      throw InvalidArgument("--benchmark needs the frames of {} as pictures{}",
                            folder_.camera_films[0].file.string(),
                            folder_.model_files.empty()
                                ? ", each camera's in a folder of its own, with --film"
                                : ", named in transforms.json with their times");
    }
    if (options_.benchmark && folder_.film) DecodeFilmForBenchmark();
    if (options_.benchmark) RequireColorPhotos(folder_, *context_.interrupt);
    for (const std::string& note : folder_.notes) PrintNote(context_, note);
    Connect();
    if (options_.benchmark) {
      return Finish(PrepareBenchmark(*connection_, context_, options_, folder_, display_));
    }
    const std::string scene = UploadFolder(*connection_, context_, folder_, display_);
    return options_.color.HasSource() ? Finish(ColorSpec(scene)) : SelectOnly(scene);
  }

 private:
  void Connect() {
    PrepareOut(out_);
    connection_ = std::make_unique<Connection>(context_.server, *context_.interrupt);
  }

  // Replaces the film by its frames as pictures, so that their colour can be dropped.
  void DecodeFilmForBenchmark() {
    frames_.emplace();
    const v1::ImportSceneSpec import = ImportSpec(options_, "").import_scene();
    FilmAsFrames film = DecodeFilmFrames(
        folder_,
        import.has_film_end_s() ? std::optional(import.film_end_s()) : std::nullopt,
        frames_->path(),
        *context_.interrupt,
        [&](int done, int total) { display_.OnCount("reading frame", done, total); });
    folder_ = std::move(film.folder);
    if (import.has_film_frames_per_second()) return;
    options_.settings.push_back(
        fmt::format("import_scene.film_frames_per_second={}", film.frames_per_second));
  }

  // Colours a scene on the server from the given source, else from its accepted key view.
  ExitCode RunStored() {
    Connect();
    const std::string scene = ResourceName(options_.scene, "scenes");
    return Finish(options_.color.HasSource() ? ColorSpec(scene) : AcceptedSpec(scene));
  }

  v1::JobSpec AcceptedSpec(const std::string& scene) {
    if (!options_.key_view.empty() || options_.hold_out || options_.deflicker || options_.poses) {
      throw InvalidArgument(
          "--key-view, --hold-out, --deflicker and --poses were fixed when the key view was "
          "selected (`color3d key select`); leave them out, or select again with them");
    }
    const KeyState state = ReadKeyState(*connection_, scene);
    if (!state.accepted) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "{} has no accepted key view: give a source of colour (--auto, ...), or select, "
                  "colour and accept a key view (`color3d key select`, `key color`, `key accept`)",
                  scene);
    }
    v1::JobSpec spec = ColorizeSpec(options_, scene);
    spec.mutable_colorize_scene()->clear_select_key_view();
    AddKeyViews(*connection_, options_, spec.mutable_colorize_scene());
    AddColorizer(*connection_, options_, spec.mutable_colorize_scene());
    for (const std::string& input : JobAndInputs(*connection_, *state.accepted)) {
      spec.add_inputs(input);
    }
    display_.PrintLine(fmt::format("key view {}, as accepted ({})",
                                   ReadChoice(*connection_, *state.accepted).view,
                                   state.accepted->name()));
    return spec;
  }

  // Returns the key view of an earlier selection in the folder of results; may be empty.
  std::string SelectedView() const {
    const auto key_view = ReadResult(out_, artifact::kKeyView);
    const auto view = key_view.find("view");
    return view != key_view.end() && view->is_string() ? view->get<std::string>() : "";
  }

  // Returns the view that the given colour belongs to; empty: the server selects it.
  std::string KeyView() const {
    if (!options_.key_view.empty()) return options_.key_view;
    // A file with the name of a photo is that photo, regardless of an earlier selection.
    const std::string same_stem = FindPhotoByStem(folder_, options_.color.PictureOfView());
    if (!same_stem.empty()) return same_stem;
    const std::string view = SelectedView();
    // The selection may be of another scene.
    const bool known = std::ranges::any_of(
        folder_.photos, [&](const LocalFile& photo) { return Stem(photo.path) == Stem(view); });
    return known ? view : "";
  }

  v1::JobSpec ColorSpec(const std::string& scene) {
    v1::JobSpec spec = ColorizeSpec(options_, scene);
    v1::ColorizeSceneSpec* colorize = spec.mutable_colorize_scene();
    colorize->set_key_view(KeyView());
    *colorize->mutable_key_color() = UploadKeyColor(*connection_, options_.color);
    AddKeyViews(*connection_, options_, colorize);
    AddColorizer(*connection_, options_, colorize);
    display_.PrintLine("key view " + (colorize->key_view().empty() ? std::string("will be selected")
                                                                   : colorize->key_view()));
    return spec;
  }

  ExitCode Finish(const v1::JobSpec& spec) {
    const std::optional<v1::JobPlan> plan = ShowPlan(*connection_, spec, display_);
    return Submit(spec, {}, [&](nlohmann::ordered_json result) {
      if (!context_.json) return PrintText(Summary(out_) + PlanCheck(plan));
      result["metrics"] = ReadResult(out_, artifact::kMetrics);
      if (plan) result["plan"] = ToJson(*plan);
      PrintJson(result);
    });
  }

  // The lines that compare the plan with seconds and peak memory of the results; without those
  // that are unknown.
  std::string PlanCheck(const std::optional<v1::JobPlan>& plan) const {
    if (!plan) return "";
    const auto metrics = ReadResult(out_, artifact::kMetrics);
    std::string text;
    const auto seconds = metrics.find("seconds_total");
    if (seconds != metrics.end() && seconds->is_number()) {
      text += PlanCheckText(plan->expected_seconds(), seconds->get<double>()) + "\n";
    }
    const auto peak = metrics.find("peak_memory_bytes");
    if (peak != metrics.end() && peak->is_number() && plan->expected_peak_memory_bytes() > 0) {
      text += MemoryCheckText(plan->expected_peak_memory_bytes(), peak->get<int64_t>()) + "\n";
    }
    return text;
  }

  // Submits the job, follows it and `earlier` ones, and downloads its results. With --detach
  // submits only. `print` receives the facts that --json prints.
  ExitCode Submit(const v1::JobSpec& spec,
                  std::vector<std::string> earlier,
                  const std::function<void(nlohmann::ordered_json)>& print) {
    const v1::Job submitted = SubmitJob(*connection_, spec, options_.submission);
    if (options_.detach) return Detached(submitted);
    earlier.push_back(submitted.name());
    const v1::Job job = FollowToSuccess(*connection_, context_, earlier, out_.string(), display_);
    const auto files = DownloadResults(*connection_, context_, job, out_, display_);
    CreditPictures(out_, files, credit_);
    print({{"job", job.name()},
           {"scene", spec.scene()},
           {"state", StateName(job.state())},
           {"out", out_.string()},
           {"files", files}});
    return ExitCode::kOk;
  }

  ExitCode SelectOnly(const std::string& scene) {
    std::vector<std::string> jobs;
    v1::JobSpec spec = SelectSpec(*connection_, options_, scene);
    const v1::JobSpec import = ImportSpec(options_, scene);
    if (import.import_scene().ByteSizeLong() > 0) {  // else the default import
      jobs.push_back(SubmitJob(*connection_, import).name());
      spec.add_inputs(jobs.back());
    }
    return Submit(spec, std::move(jobs), [&](nlohmann::ordered_json result) {
      const std::string view = SelectedView();
      if (!context_.json) return PrintText(NextCommands(view));
      result["key_view"] = view;
      PrintJson(result);
    });
  }

  std::string NextCommands(const std::string& view) const {
    const std::string picture = (out_ / artifact::kKeyViewGray).string();
    const std::string again = "  color3d " + ShellLine(context_.arguments);
    return "The key view is " + view + ", saved as " + picture +
           ".\nColour it, keep its size, and run\n" + again +
           " --key-color COLOURED.png\nor paint a few colour strokes on a transparent PNG of its "
           "size (or list points as JSON) and run\n" +
           again + " --hints STROKES.png\nor let the server guess the colours:\n" + again +
           " --auto\n";
  }

  ExitCode Detached(const v1::Job& job) {
    if (context_.json) {
      PrintJson({{"job", job.name()}, {"scene", job.spec().scene()}, {"detached", true}});
    } else {
      PrintText(job.name() + "\n");
      PrintNote(context_, ReattachHint(context_, job.name(), out_.string()));
    }
    return ExitCode::kOk;
  }

  const Context& context_;
  ColorizeOptions options_;
  const CreditFlags credit_;
  const fs::path out_;
  ProgressDisplay display_;
  PhotoFolder folder_;
  std::optional<ScratchFolder> frames_;  // of a film, for --benchmark
  std::unique_ptr<Connection> connection_;
};

}  // namespace

void AddColorizeCommand(CLI::App& app, Context& context) {
  const auto options = std::make_shared<ColorizeOptions>();
  const auto credit = std::make_shared<CreditFlags>();
  CLI::App* colorize = AddCommand(
      app,
      context,
      "colorize",
      "Make a coloured 3D scene from photos, or colour a film. Without a source of colour: select "
      "the photo to colour",
      [&context, options, credit] { return Colorize(context, *options, *credit).Run(); });
  DeclareOptions(*colorize, options.get());
  DeclareCreditFlags(*colorize, credit.get(), /*with_caption=*/false);
}

}  // namespace color3d::client

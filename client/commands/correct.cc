// `color3d correct`: corrects a coloured scene by strokes on its photos, saturation and white
// balance.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/commands/colored_scene.h"
#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/lib/job_watch.h"
#include "client/lib/text.h"
#include "client/options/key_color_flags.h"
#include "core/base/digest.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr char kAllCorrections[] = "all";

struct CorrectOptions {
  std::string target;  // folder of results, jobs/ID or scenes/ID
  std::string out;     // empty: the target, when that is a folder
  std::string view;
  KeyColorFlags paint;  // hints, labels or image
  std::string at;       // "X,Y" px of the photo
  std::string color;    // "#rrggbb"
  double radius = 8.0;  // px
  std::string undo;     // a number of corrections, or kAllCorrections
  std::optional<double> saturation, tint, warmth;
  std::optional<int> proposals;

  bool Paints() const { return paint.HasSource() || !at.empty(); }
  bool ChangesScene() const { return saturation || tint || warmth; }
};

// Returns a disc in the format of hints.
std::string PointHints(const CorrectOptions& options) {
  double x = 0.0, y = 0.0;
  int end = 0;
  if (std::sscanf(options.at.c_str(), "%lf,%lf%n", &x, &y, &end) != 2 ||
      static_cast<size_t>(end) != options.at.size()) {
    throw InvalidArgument(
        "--at {} is not a position; give X,Y in px of the photo, e.g. --at 320,180", options.at);
  }
  const nlohmann::json hints = {
      {{"x", x}, {"y", y}, {"radius", options.radius}, {"color", options.color}}};
  return hints.dump();
}

void Check(const CorrectOptions& options) {
  options.paint.Check();
  if (!options.at.empty()) {
    if (options.paint.HasSource()) {
      throw InvalidArgument("--at cannot be combined with --hints or --image; give one of them");
    }
    if (options.color.empty()) {
      throw InvalidArgument("--at needs the colour of the place: --color \"#rrggbb\"");
    }
    PointHints(options);
  } else if (!options.color.empty()) {
    throw InvalidArgument("--color needs a place: --at X,Y");
  }
  if (options.Paints() && options.view.empty()) {
    throw InvalidArgument("--view is missing: the photo that was painted on");
  }
  if (!options.view.empty() && !options.Paints()) {
    throw InvalidArgument(
        "--view {} needs a correction: --hints FILE, --image FILE, or --at X,Y --color "
        "\"#rrggbb\"",
        options.view);
  }
}

// Removes the last corrections. Throws Error{kInvalidArgument} if there are fewer.
void RemoveCorrections(const std::string& how_many, v1::CorrectColorsSpec* correct) {
  const int count = correct->corrections_size();
  int drop = 0, end = 0;
  if (how_many == kAllCorrections) {
    drop = count;
  } else if (std::sscanf(how_many.c_str(), "%d%n", &drop, &end) != 1 || drop < 1 ||
             static_cast<size_t>(end) != how_many.size()) {
    throw InvalidArgument("--undo {} is not a number of corrections; give a number, or all",
                          how_many);
  }
  if (count == 0 || drop > count) {
    throw Error(ErrorCode::kFailedPrecondition,
                "--undo {}: this scene has {} corrections",
                how_many,
                count);
  }
  for (int i = 0; i < drop; ++i) correct->mutable_corrections()->RemoveLast();
}

// Writes the disc as a file of hints, which stays among the results.
v1::KeyColorSource Upload(Connection& connection, const CorrectOptions& options) {
  if (options.at.empty()) return UploadKeyColor(connection, options.paint);
  const fs::path file = fs::path(options.out) / "point.json";
  WriteFileAtomic(file, PointHints(options));
  KeyColorFlags flags;
  flags.hints = file.string();
  return UploadKeyColor(connection, flags);
}

v1::JobSpec MakeSpec(Connection& connection, const CorrectOptions& options, const v1::Job& job) {
  v1::JobSpec spec = job.spec();
  spec.set_skip_cache(false);
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  v1::CorrectColorsSpec* correct = scene->mutable_correct_colors();
  if (!options.undo.empty()) RemoveCorrections(options.undo, correct);
  if (options.Paints()) {
    v1::FurtherKeyView* correction = correct->add_corrections();
    correction->set_view(options.view);
    *correction->mutable_color() = Upload(connection, options);
  }
  if (options.proposals) correct->set_proposals(*options.proposals);
  // Changes of the whole scene need no correct_colors stage.
  if (correct->corrections().empty() && !options.proposals &&
      (options.ChangesScene() || !options.undo.empty())) {
    scene->clear_correct_colors();
  }
  v1::SolveChromaSpec* solve = scene->mutable_solve_chroma();
  if (options.saturation) solve->set_saturation(*options.saturation);
  if (options.tint) solve->set_tint(*options.tint);
  if (options.warmth) solve->set_warmth(*options.warmth);
  return spec;
}

// Replaces the pictures to paint on by those of this job. Pictures that the user has painted on are
// kept under another name.
void ClearPaintFolder(const Context& context, const fs::path& out, const v1::Job& before) {
  const fs::path folder = out / artifact::kPaint;
  std::error_code none;
  if (!fs::is_directory(fs::symlink_status(folder, none))) return;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().stem().extension() != ".painted") {
      files.push_back(entry.path());
    }
  }
  for (const fs::path& file : files) {
    const std::string name = artifact::kPaint + file.filename().string();
    const std::string digest = DigestFile(file).sha256;
    const bool ours = std::ranges::any_of(before.artifacts(), [&](const v1::Artifact& artifact) {
      return artifact.name() == name && artifact.digest().sha256() == digest;
    });
    if (ours) {
      fs::remove(file);
      continue;
    }
    fs::path kept = file;
    kept.replace_extension(".painted" + file.extension().string());
    for (int number = 2; fs::exists(kept); ++number) {
      kept = file;
      kept.replace_extension(fmt::format(".{}.painted{}", number, file.extension().string()));
    }
    fs::rename(file, kept);
    PrintNote(context, "the painted picture is kept as " + kept.string());
  }
}

void FetchScene(Connection& connection,
                const v1::Job& exported,
                const fs::path& out,
                ProgressDisplay& display) {
  const auto& results = FindStage(kind::kExport)->results;
  std::vector<v1::Artifact> files;
  const v1::Job fresh = GetJob(connection, exported.name());
  for (const v1::Artifact& artifact : fresh.artifacts()) {
    const auto same_name = [&](const char* name) { return artifact.name() == name; };
    if (std::ranges::any_of(results, same_name)) files.push_back(artifact);
  }
  const auto fetched = DownloadArtifacts(connection, files, out, display);
  if (std::ranges::find(fetched, artifact::kViewPage) == fetched.end()) return;
  display.PrintLine((out / artifact::kViewPage).string() +
                    " shows the corrected scene; metrics follow");
}

std::string ProposalText(const Context& context,
                         const std::string& target,
                         const fs::path& out,
                         const nlohmann::ordered_json& facts) {
  const auto proposals = facts.value("proposals", nlohmann::ordered_json::array());
  if (proposals.empty()) return "";
  std::string text = "Places where a stroke would correct most:\n";
  for (const auto& place : proposals) {
    const std::string view = place.at("view");
    const fs::path picture =
        out / (artifact::kPaint + fs::path(view).replace_extension().filename().string() + ".png");
    text += fmt::format("  {} at {},{}{}\n",
                        view,
                        place.at("x").get<int>(),
                        place.at("y").get<int>(),
                        fs::exists(picture) ? "  " + picture.string() : "");
  }
  const std::string view = proposals.at(0).at("view");
  text += "Paint on such a picture and run\n  " +
          CommandLine(context, {"correct", target, "--view", view, "--image", "PAINTED.png"}) +
          "\nor give one place a colour\n  " +
          CommandLine(
              context,
              {"correct",
               target,
               "--view",
               view,
               "--at",
               fmt::format(
                   "{},{}", proposals.at(0).at("x").get<int>(), proposals.at(0).at("y").get<int>()),
               "--color",
               "#rrggbb"}) +
          "\n";
  return text;
}

ExitCode RunCorrect(const Context& context, CorrectOptions options) {
  Check(options);
  const bool folder = !IsOnServer(options.target);
  if (options.out.empty()) options.out = folder ? options.target : "corrected";
  // Without a correction: proposals only.
  if (!options.Paints() && !options.ChangesScene() && options.undo.empty() && !options.proposals) {
    options.proposals = 3;
  }
  Connection connection(context.server, *context.interrupt);
  const v1::Job before = FindColoredScene(connection, options.target);
  if (before.kind() != kind::kColorizeScene) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} is a {} job; only {} jobs can be corrected",
                before.name(),
                before.kind(),
                kind::kColorizeScene);
  }
  PrepareOut(options.out);
  const v1::Job submitted = SubmitJob(connection, MakeSpec(connection, options, before));
  ProgressDisplay display(context.json);
  // The corrected scene can be viewed before it is scored and reported.
  const auto fetch_scene = [&](const v1::Job& stage) {
    if (stage.kind() == kind::kExport) FetchScene(connection, stage, options.out, display);
  };
  const v1::Job job =
      FollowToSuccess(connection, context, {submitted.name()}, options.out, display, fetch_scene);
  ClearPaintFolder(context, options.out, before);
  const auto files = DownloadResults(connection, context, job, options.out, display);
  const auto facts = ReadResult(options.out, artifact::kCorrections);
  const int corrections = job.spec().colorize_scene().correct_colors().corrections_size();
  if (context.json) {
    PrintJson({{"job", job.name()},
               {"scene", job.spec().scene()},
               {"state", StateName(job.state())},
               {"out", options.out},
               {"files", files},
               {"corrections", corrections},
               {"proposals",
                facts.is_object() ? facts.value("proposals", nlohmann::ordered_json())
                                  : nlohmann::ordered_json()},
               {"metrics", ReadResult(options.out, artifact::kMetrics)}});
    return ExitCode::kOk;
  }
  std::string text = Summary(options.out);
  if (corrections > 0) {
    text += fmt::format("{} correction{}; `{}` removes the last one\n",
                        corrections,
                        corrections == 1 ? "" : "s",
                        CommandLine(context, {"correct", options.target, "--undo", "1"}));
  }
  if (job.spec().colorize_scene().has_correct_colors() && facts.is_object()) {
    text += ProposalText(context, options.target, options.out, facts);
  }
  PrintText(text);
  return ExitCode::kOk;
}

void DeclareOptions(CLI::App* command, CorrectOptions* options) {
  command
      ->add_option("RESULTS",
                   options->target,
                   "Folder of results that `color3d colorize` wrote, or jobs/ID or scenes/ID")
      ->required();
  command->add_option(
      "-o,--out", options->out, "Folder for the results; default: RESULTS if that is a folder");
  const char* place = "One place (its colour spreads to similar surfaces nearby, in all views)";
  command->add_option("--view", options->view, "Name of the photo that was painted on")
      ->group(place);
  command
      ->add_option("--hints,--strokes,--points",
                   options->paint.hints,
                   "Colour strokes (PNG with the aspect ratio of the photo, transparent "
                   "elsewhere), or points, lines and regions (JSON)")
      ->group(place);
  command
      ->add_option("--labels",
                   options->paint.labels,
                   "Grey PNG with the labels of the \"label\" entries of points")
      ->group(place);
  command
      ->add_option("--image",
                   options->paint.image,
                   "Corrected copy of the photo, e.g. RESULTS/paint/NAME.png after painting on it; "
                   "only changed pixels count")
      ->group(place);
  command->add_option("--at", options->at, "Position of a disc to correct: X,Y in px of the photo")
      ->group(place);
  command->add_option("--color", options->color, "Colour of the disc: \"#rrggbb\"")->group(place);
  command->add_option("--radius", options->radius, "Radius of the disc, px")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(place);
  const char* whole = "The whole scene";
  command
      ->add_option(
          "--saturation", options->saturation, "Factor of the saturation, 0 to 4; 1: unchanged")
      ->group(whole);
  command
      ->add_option("--warmth",
                   options->warmth,
                   "White balance, blue to yellow: b of a middle grey, -50 to 50")
      ->group(whole);
  command
      ->add_option(
          "--tint", options->tint, "White balance, green to red: a of a middle grey, -50 to 50")
      ->group(whole);
  command->add_option(
      "--undo", options->undo, "Number of corrections to remove, the last first; or all");
  command->add_option("--proposals",
                      options->proposals,
                      "Number of places to propose for strokes; default without a correction: 3");
}

}  // namespace

void AddCorrectCommand(CLI::App& app, Context& context) {
  const auto options = std::make_shared<CorrectOptions>();
  DeclareOptions(AddCommand(app,
                            context,
                            "correct",
                            "Correct the colours of a coloured scene; its geometry is kept",
                            [&context, options] { return RunCorrect(context, *options); }),
                 options.get());
}

}  // namespace color3d::client

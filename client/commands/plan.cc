// `color3d plan`: what `color3d colorize` would do, and how long it would take. Uploads nothing.
#include "client/commands/plan.h"

#include <memory>
#include <sstream>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/names.h"
#include "client/lib/photos/mask_files.h"
#include "client/lib/photos/photo_folder.h"
#include "client/lib/plan_text.h"
#include "client/options/additional_key_view.h"
#include "client/options/colorize_options.h"

namespace color3d::client {
namespace {

v1::CaptureFacts CaptureOf(const PhotoFolder& folder) {
  v1::CaptureFacts capture;
  capture.set_layout(static_cast<v1::Scene::Layout>(folder.Layout()));
  capture.set_photo_count(static_cast<int>(folder.photos.size()));
  capture.set_augment_file_count(static_cast<int>(folder.augment_files.size()));
  return capture;
}

PhotoFolder CollectCapture(const ColorizeOptions& options) {
  PhotoFolder folder = CollectPhotos(options.photos, options.film);
  if (!options.masks.empty()) AddMasks(options.masks, &folder);
  if (options.film) UsePhotosAsFrames(&folder);
  if (!options.key_view.empty()) RequirePhoto(folder, options.key_view);
  RequireAugmentFiles(options, folder);
  return folder;
}

// The request of `color3d colorize` without its uploads. Every source of colour takes about the
// same time, so that the automatic one stands in for pictures.
v1::JobSpec SpecToPlan(const ColorizeOptions& options, const std::string& key_view) {
  v1::JobSpec spec = ColorizeSpec(options, "");
  v1::ColorizeSceneSpec* colorize = spec.mutable_colorize_scene();
  colorize->set_key_view(key_view);
  colorize->mutable_key_color()->set_automatic(true);
  for (const std::string& text : options.additional_key_views) {
    const AdditionalKeyView key = ParseAdditionalKeyView(text);
    v1::FurtherKeyView* added = colorize->mutable_carry_color()->add_further_key_views();
    added->set_view(key.view);
    added->mutable_color()->set_automatic(true);
    if (key.begin_s) added->set_begin_s(*key.begin_s);
    if (key.end_s) added->set_end_s(*key.end_s);
  }
  return spec;
}

ExitCode Plan(const Context& context, const ColorizeOptions& options) {
  options.Check();
  v1::PlanJobRequest request;
  if (options.scene.empty()) {
    const PhotoFolder folder = CollectCapture(options);
    const std::string key_view = !options.key_view.empty()
                                     ? options.key_view
                                     : FindPhotoByStem(folder, options.color.PictureOfView());
    *request.mutable_spec() = SpecToPlan(options, key_view);
    *request.mutable_facts() = CaptureOf(folder);
  } else {
    *request.mutable_spec() = SpecToPlan(options, options.key_view);
    request.mutable_spec()->set_scene(ResourceName(options.scene, "scenes"));
  }
  Connection connection(context.server, *context.interrupt);
  const auto plan = connection.Call(&v1::JobService::Stub::PlanJob, connection.jobs(), request);
  return PrintAnswer(context, plan, PlanText(plan));
}

}  // namespace

std::optional<v1::JobPlan> ShowPlan(Connection& connection,
                                    const v1::JobSpec& spec,
                                    ProgressDisplay& display) {
  v1::PlanJobRequest request;
  *request.mutable_spec() = spec;
  try {
    const auto plan = connection.Call(&v1::JobService::Stub::PlanJob, connection.jobs(), request);
    std::istringstream lines(PlanText(plan));
    for (std::string line; std::getline(lines, line);) display.PrintLine(line);
    return plan;
  } catch (const RpcError& e) {
    if (e.grpc_code() != grpc::StatusCode::UNIMPLEMENTED) throw;
    return std::nullopt;
  }
}

void AddPlanCommand(CLI::App& app, Context& context) {
  const auto options = std::make_shared<ColorizeOptions>();
  CLI::App* plan = AddCommand(app,
                              context,
                              "plan",
                              "Tell what `color3d colorize` would do with the same options, and "
                              "how long it would take. Uploads nothing",
                              [&context, options] { return Plan(context, *options); });
  DeclareOptions(*plan, options.get());
  plan->get_option("--out")->required(false);
}

}  // namespace color3d::client

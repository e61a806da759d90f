#include "client/options/key_color_flags.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "client/lib/blob_transfer.h"
#include "client/lib/scene_upload.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

void RequireImage(const std::string& option, const std::string& file) {
  if (!IsFile(file)) {
    throw Error(ErrorCode::kNotFound, "{}: there is no file {}; give a picture", option, file);
  }
  try {
    ProbeImage(ReadFile(file), file);
  } catch (const Error& e) {
    throw Error(e.code(), "{}: {}", option, e.what());
  }
}

bool IsJson(const std::string& file) { return fs::path(file).extension() == ".json"; }

void RequirePoints(const std::string& file) {
  const std::string format = R"([{"x": 120, "y": 80, "radius": 3, "color": "#a0522d"}, ...])";
  const auto json = nlohmann::json::parse(ReadFile(file), nullptr, /*allow_exceptions=*/false);
  if (!json.is_structured() || json.empty()) {
    throw InvalidArgument("--hints: {} is not a JSON list of points: {}", file, format);
  }
}

void CheckFiles(const KeyColorFlags& flags) {
  if (!flags.image.empty()) RequireImage("--key-color", flags.image);
  if (!flags.edit.empty()) RequireImage("--edit", flags.edit);
  if (!flags.mask.empty()) RequireImage("--mask", flags.mask);
  if (!flags.labels.empty()) RequireImage("--labels", flags.labels);
  for (const std::string& file : flags.references) RequireImage("--reference", file);
  if (flags.hints.empty()) return;
  if (IsJson(flags.hints)) {
    RequirePoints(flags.hints);
  } else {
    RequireImage("--hints", flags.hints);
  }
}

// Returns the given flags that are sources of their own; with a backend some of them are its input.
std::vector<std::string> Sources(const KeyColorFlags& flags) {
  std::vector<std::string> sources;
  const auto add = [&](bool given, const char* flag) {
    if (given) sources.push_back(flag);
  };
  add(!flags.backend.empty(), "--backend");
  add(!flags.image.empty(), "--key-color");
  add(!flags.edit.empty(), "--edit");
  add(flags.automatic, "--auto");
  add(!flags.script.empty(), "--script");
  if (!flags.backend.empty()) return sources;
  add(!flags.references.empty(), "--reference");
  add(!flags.prompt.empty(), "--prompt");
  if (sources.empty()) add(!flags.hints.empty(), "--hints");  // else above the source
  return sources;
}

bool HasHintsAbove(const KeyColorFlags& flags) {
  const bool is_alone = Sources(flags) == std::vector<std::string>{"--hints"};
  return !flags.hints.empty() && flags.backend.empty() && !is_alone;
}

void CheckCombination(const KeyColorFlags& flags) {
  const std::vector<std::string> sources = Sources(flags);
  if (sources.size() > 1) {
    throw InvalidArgument("{} and {} exclude each other: the colour of the key view has one source",
                          sources[0],
                          sources[1]);
  }
  const bool backend = !flags.backend.empty();
  if (!flags.mask.empty() && flags.edit.empty() && !backend) {
    throw InvalidArgument("--mask needs --edit or --backend");
  }
  if (!flags.labels.empty() && (backend || flags.hints.empty() || !IsJson(flags.hints))) {
    throw InvalidArgument(
        "--labels needs --hints POINTS.json, whose \"label\" entries refer to its values; "
        "omit it");
  }
  if ((backend || HasHintsAbove(flags)) && !flags.hints.empty() && !IsJson(flags.hints)) {
    throw InvalidArgument("--hints {} must be points (a .json file), not {}",
                          backend ? "of a backend" : "above the colours of another source",
                          flags.hints);
  }
  if (backend && flags.references.size() > 1) {
    throw InvalidArgument("a backend takes one --reference, not {}", flags.references.size());
  }
  const bool takes_model =
      !backend && (flags.automatic || !flags.prompt.empty() || !flags.references.empty());
  if (!flags.model.empty() && !takes_model) {
    throw InvalidArgument("--model needs --auto, --prompt or --reference; omit it");
  }
  if (!backend && !flags.prompt.empty() && flags.model.empty()) {
    throw InvalidArgument(
        "--prompt needs --model NAME: CLIP weights configured on the server (`color3d "
        "server info` lists them)");
  }
}

// Collects files to upload and their digests.
class Uploads {
 public:
  v1::Digest Add(const std::string& file) {
    files_.push_back({file, DigestFile(file)});
    return ToProto(files_.back().digest);
  }
  void Send(Connection& connection) const {
    if (!files_.empty()) UploadMissing(connection, files_, [](int64_t, int64_t) {});
  }

 private:
  std::vector<UploadFile> files_;
};

void FillBackend(const KeyColorFlags& flags, Uploads* uploads, v1::KeyColorSource* source) {
  source->set_backend(flags.backend);
  v1::BackendInput* input = source->mutable_backend_input();
  input->set_prompt(flags.prompt);
  if (!flags.hints.empty()) *input->mutable_points() = uploads->Add(flags.hints);
  if (!flags.references.empty()) *input->mutable_reference() = uploads->Add(flags.references[0]);
  if (!flags.mask.empty()) *input->mutable_mask() = uploads->Add(flags.mask);
}

v1::KeyColorSource MakeSource(const KeyColorFlags& flags, Uploads* uploads) {
  v1::KeyColorSource source;
  source.set_model(flags.model);
  if (!flags.backend.empty()) {
    FillBackend(flags, uploads, &source);
  } else if (!flags.image.empty()) {
    *source.mutable_image() = uploads->Add(flags.image);
  } else if (!flags.edit.empty()) {
    *source.mutable_edit()->mutable_image() = uploads->Add(flags.edit);
    if (!flags.mask.empty()) *source.mutable_edit()->mutable_mask() = uploads->Add(flags.mask);
  } else if (flags.automatic) {
    source.set_automatic(true);
  } else if (!flags.script.empty()) {
    source.set_script(flags.script);
  } else if (!flags.references.empty()) {
    for (const std::string& file : flags.references) {
      *source.mutable_references()->add_images() = uploads->Add(file);
    }
  } else if (!flags.prompt.empty()) {
    source.set_prompt(flags.prompt);
  } else if (IsJson(flags.hints)) {
    *source.mutable_points() = uploads->Add(flags.hints);
    if (!flags.labels.empty()) *source.mutable_labels() = uploads->Add(flags.labels);
  } else {
    *source.mutable_strokes() = uploads->Add(flags.hints);
  }
  if (HasHintsAbove(flags)) {
    *source.mutable_backend_input()->mutable_points() = uploads->Add(flags.hints);
    if (!flags.labels.empty()) *source.mutable_labels() = uploads->Add(flags.labels);
  }
  return source;
}

}  // namespace

bool KeyColorFlags::HasSource() const { return !Sources(*this).empty(); }

std::string KeyColorFlags::PictureOfView() const {
  for (const std::string& file : {image, hints, edit}) {
    if (!file.empty()) return file;
  }
  return "";
}

void KeyColorFlags::Check() const {
  CheckCombination(*this);
  CheckFiles(*this);
}

void DeclareKeyColorFlags(CLI::App& app, KeyColorFlags* flags) {
  const char* group = "Colour of the key view (one source, and hints above it)";
  const auto text = [&](const char* name, std::string* value, const std::string& help) {
    return app.add_option(name, *value, help)->group(group);
  };
  app.add_flag("--auto", flags->automatic, "Colour the key view automatically")->group(group);
  text("--key-color,--image",
       &flags->image,
       "The coloured key view (" + ReadableImageFormats() + "); transparent parts are inferred");
  text("--hints,--strokes,--points",
       &flags->hints,
       "Colour strokes (PNG of the key view's size, transparent elsewhere), or points, lines and "
       "regions (JSON); points besides another source change its colours where they lie");
  text("--labels", &flags->labels, "Grey PNG with the values of the \"label\" entries of points");
  app.add_option("--reference",
                 flags->references,
                 "Coloured picture of a similar scene; if repeated, the best match is used")
      ->allow_extra_args(false)
      ->group(group);
  text("--prompt",
       &flags->prompt,
       "Description of the colours, e.g. \"red brick, green lawn\" (needs --model)");
  text("--edit", &flags->edit, "Edited version of a key photo in colour");
  text("--mask", &flags->mask, "Mask for --edit or --backend, white where colour may change");
  text("--backend",
       &flags->backend,
       "Name of a model server configured on the server; accepts --prompt, --points, --reference "
       "and --mask");
  text("--script", &flags->script, "Name of a TorchScript model configured on the server");
  text("--model",
       &flags->model,
       "Name of weights configured on the server, for --auto, --prompt or --reference");
}

v1::KeyColorSource UploadKeyColor(Connection& connection, const KeyColorFlags& flags) {
  Uploads uploads;
  const v1::KeyColorSource source = MakeSource(flags, &uploads);
  uploads.Send(connection);
  return source;
}

}  // namespace color3d::client

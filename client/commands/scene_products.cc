#include "client/commands/scene_products.h"

#include <algorithm>

#include "client/commands/key_jobs.h"
#include "core/base/error.h"
#include "core/catalogue/export_formats.h"

namespace color3d::client {
namespace {

using google::protobuf::FieldDescriptor;

// The switches of formats; formats with a number of files are left to `colorize --set`.
bool IsSwitch(const ExportFormatInfo& format) {
  const FieldDescriptor* field = v1::ExportSpec::descriptor()->FindFieldByName(format.option);
  return field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL;
}

std::string SwitchNames() {
  std::string names;
  for (const ExportFormatInfo& format : kExportFormats) {
    if (IsSwitch(format)) names += (names.empty() ? "" : ", ") + std::string(format.option);
  }
  return names;
}

const ExportFormatInfo& FindFormat(const std::string& name) {
  const auto found = std::ranges::find_if(kExportFormats, [&](const ExportFormatInfo& format) {
    return format.option == name && IsSwitch(format);
  });
  if (found == std::end(kExportFormats)) {
    throw InvalidArgument("there is no format {}; choose among {}", name, SwitchNames());
  }
  return *found;
}

}  // namespace

v1::JobSpec SpecOn(Connection& connection, const v1::Job& of) {
  v1::JobSpec spec;
  spec.set_scene(of.spec().scene());
  for (const std::string& input : JobAndInputs(connection, of)) spec.add_inputs(input);
  return spec;
}

void SetSideOf(const v1::Job& of, v1::RenderSpec* render) {
  if (of.spec().colorize_scene().has_max_side_px()) {
    render->set_max_side_px(of.spec().colorize_scene().max_side_px());
  }
}

v1::ExportSpec ExportOf(const std::vector<std::string>& formats) {
  for (const std::string& name : formats) FindFormat(name);
  v1::ExportSpec spec;
  for (const ExportFormatInfo& format : kExportFormats) {
    if (!IsSwitch(format)) continue;
    const bool is_wanted = std::ranges::find(formats, format.option) != formats.end();
    spec.GetReflection()->SetBool(
        &spec, v1::ExportSpec::descriptor()->FindFieldByName(format.option), is_wanted);
  }
  return spec;
}

std::vector<std::string> ArtifactsOfFormats(const std::vector<std::string>& formats) {
  std::vector<std::string> names;
  for (const std::string& format : formats) names.emplace_back(FindFormat(format).artifact);
  return names;
}

}  // namespace color3d::client

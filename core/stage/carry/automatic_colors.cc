#include "core/stage/carry/automatic_colors.h"

#include <nlohmann/json.hpp>
#include <string>

#include "core/catalogue/artifacts.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

std::shared_ptr<const AutomaticColorizer> ColorizerOfKeyView(const StageContext& context) {
  if (!context.HasInput(artifact::kKeyColorFacts)) return nullptr;
  auto embedded = AutomaticColorizer::Embedded();
  const std::string description =
      ReadJson(context, artifact::kKeyColorFacts).value("description", "");
  return description == embedded->description() ? embedded : nullptr;
}

}  // namespace color3d

#include "core/stage/formats/carry_facts.h"

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/json_artifact.h"

namespace color3d {

using nlohmann::ordered_json;

CarryFacts ReadCarryFacts(const StageContext& context) {
  CarryFacts facts;
  if (!context.HasInput(artifact::kCarryFacts)) return facts;
  ParseArtifact(context, artifact::kCarryFacts, [&](const ordered_json& json) {
    if (json.contains("coverage")) facts.coverage = json.at("coverage").get<double>();
    facts.key_views = json.value("key_views", facts.key_views);
    for (const ordered_json& view : json.value("views", ordered_json::array())) {
      facts.view_coverage[view.at("view").get<std::string>()] = view.at("coverage").get<double>();
    }
  });
  return facts;
}

void WriteCarryFacts(const CarryFacts& facts, StageContext& context) {
  ordered_json json{{"key_views", facts.key_views}};
  for (const auto& [view, coverage] : facts.view_coverage) {
    json["views"].push_back({{"view", view}, {"coverage", coverage}});
  }
  if (facts.coverage) json["coverage"] = *facts.coverage;
  context.WriteOutput(artifact::kCarryFacts, json.dump(1) + "\n");
}

}  // namespace color3d

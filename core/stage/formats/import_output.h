// Writes the artifacts of an import. For core/stage only.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/scene/import/import.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

// Reports the warnings and writes kScene, kImportFacts and, if there is one, kSfmLog. `films`: the
// film of each camera, by its name; `film`: findings of the search for poses. Throws what
// CheckStemsAreUnique throws.
void WriteImported(const ImportResult& result,
                   StageContext& context,
                   const std::map<std::string, std::string>& films = {},
                   const std::optional<FilmFindings>& film = {});

}  // namespace color3d

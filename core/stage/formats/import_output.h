// What an import hands to the other stages. For core/stage only.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/scene/import/import.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

// Tells the warnings, and leaves kScene, kImportFacts and, where there is one, kSfmLog. `films`: by
// camera, those that its frames are of; `film`: what looking for their poses found. Throws as
// CheckStemsAreUnique.
void WriteImported(const ImportResult& result,
                   StageContext& context,
                   const std::map<std::string, std::string>& films = {},
                   const std::optional<FilmFindings>& film = {});

}  // namespace color3d

// What an import hands to the other stages. For core/stage only.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/scene/import.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/stage.h"

namespace color3d {

// Tells the warnings, and leaves kScene, kImportFacts and, where there is one, kSfmLog. `films`: by
// camera, those that its frames are of; `film`: what looking for their poses found. Throws as
// CheckStemsAreUnique.
void WriteImported(const ImportResult& result,
                   StageContext& context,
                   const std::map<std::string, std::string>& films = {},
                   const std::optional<FilmFindings>& film = {});

}  // namespace color3d

// What an import hands to the other stages. For core/stage only.
#pragma once

#include "core/scene/import.h"
#include "core/stage/stage.h"

namespace color3d {

// Tells the warnings, and leaves kScene, kImportFacts and, where there is one, kSfmLog. Throws as
// CheckStemsAreUnique.
void WriteImported(const ImportResult& result, StageContext& context);

}  // namespace color3d

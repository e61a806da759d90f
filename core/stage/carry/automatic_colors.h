// Automatic colours of views that no key view reaches. Stateless.
#pragma once

#include <memory>

#include "core/keycolor/automatic/automatic.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// The colourizer that coloured the key view by itself; null where somebody chose its colours, or
// other weights did.
std::shared_ptr<const AutomaticColorizer> ColorizerOfKeyView(const StageContext& context);

}  // namespace color3d

// For callers that run an encoder on several threads of their own.
#pragma once

namespace color3d {

// From now on torch's operations of the calling thread stay on it.
void UseOneTorchThread();

}  // namespace color3d

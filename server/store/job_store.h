// All parts of the job store, for callers that need more than one. Other callers take the narrowest
// part: ClientStore, WorkerStore or ChoreStore. Thread-safe (common_store.h).
#pragma once

#include "server/store/chore_store.h"
#include "server/store/client_store.h"
#include "server/store/worker_store.h"

namespace color3d {

class JobStore : public ClientStore, public WorkerStore, public ChoreStore {};

}  // namespace color3d

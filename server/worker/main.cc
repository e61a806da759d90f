// color3d-worker: the worker loop with every stage of the method library, or, with --inference, the
// resident worker that colours pictures live.
#include "core/simd/instruction_set.h"
#include "server/worker/worker_loop.h"

int main(int argc, char** argv) {
  return color3d::WorkerMain(
      argc,
      argv,
      {&color3d::MakeStageRunner, &color3d::MakeLiveEngine, &color3d::ActiveInstructionSet});
}

// color3d-worker: the worker loop with every stage of the method library.
#include "server/worker/worker_loop.h"

int main(int argc, char** argv) {
  return color3d::WorkerMain(argc, argv, &color3d::MakeStageRunner);
}

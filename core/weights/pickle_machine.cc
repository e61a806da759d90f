#include "core/weights/pickle_machine.h"

#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "core/weights/pickle_callables.h"

namespace color3d {
namespace {

using Kind = PickleValue::Kind;

// Bounds the memory, since one byte can make a value. The state dict of a large language model has
// about 1e5 values.
constexpr size_t kMaxValues = 500'000;
constexpr size_t kMaxTensors = 100'000;

}  // namespace

uint32_t PickleMachine::Add(PickleValue value) {
  if (graph_.values.size() >= kMaxValues) {
    throw bytes_.Damaged("has more than {} values", kMaxValues);
  }
  graph_.values.push_back(std::move(value));
  return static_cast<uint32_t>(graph_.values.size() - 1);
}

void PickleMachine::Push(Kind kind, int64_t number, std::string_view text) {
  stack_.push_back(Add({kind, number, text, {}}));
}

void PickleMachine::PushItems(Kind kind, std::vector<uint32_t> items) {
  stack_.push_back(Add({kind, 0, {}, std::move(items)}));
}

void PickleMachine::RequireAboveMark(size_t count) const {
  if (stack_.size() - (marks_.empty() ? 0 : marks_.back()) < count) {
    throw bytes_.Damaged("takes more values than there are");
  }
}

uint32_t PickleMachine::Pop() {
  RequireAboveMark(1);
  const uint32_t index = stack_.back();
  stack_.pop_back();
  return index;
}

uint32_t PickleMachine::Top() const {
  RequireAboveMark(1);
  return stack_.back();
}

std::vector<uint32_t> PickleMachine::PopLast(size_t count) {
  RequireAboveMark(count);
  std::vector<uint32_t> items(stack_.end() - static_cast<ptrdiff_t>(count), stack_.end());
  stack_.resize(stack_.size() - count);
  return items;
}

std::vector<uint32_t> PickleMachine::PopToMark() {
  if (marks_.empty()) throw bytes_.Damaged("has no mark where one is needed");
  std::vector<uint32_t> items = PopLast(stack_.size() - marks_.back());
  marks_.pop_back();
  return items;
}

void PickleMachine::Remember(uint32_t slot) {
  memo_[slot] = Top();
  if (memo_.size() > kMaxValues) throw bytes_.Damaged("remembers too many values");
}

void PickleMachine::Recall(uint32_t slot) {
  const auto found = memo_.find(slot);
  if (found == memo_.end()) throw bytes_.Damaged("recalls a value that it never stored");
  stack_.push_back(found->second);
}

const PickleValue& PickleMachine::Expect(uint32_t index, Kind kind, const char* what) const {
  const PickleValue& value = graph_.values[index];
  if (value.kind != kind) throw bytes_.Damaged("has no {} where one is needed", what);
  return value;
}

// Returns the first items of a tuple, at most `count`. Copying a long tuple in full at each use
// would take quadratic time.
std::vector<uint32_t> PickleMachine::FirstItems(uint32_t index,
                                                size_t count,
                                                const char* what) const {
  const std::vector<uint32_t>& items = Expect(index, Kind::kTuple, what).items;
  return {items.begin(), items.begin() + static_cast<ptrdiff_t>(std::min(count, items.size()))};
}

void PickleMachine::PushGlobal(std::string_view module, std::string_view name) {
  const std::optional<int64_t> callable = FindPickleCallable(module, name, allow_objects_);
  if (!callable) {
    throw bytes_.source().Refusal(
        "it asks to run {}, which is refused: only plain tensors are read; save the model's state "
        "dict (torch.save(model.state_dict(), ...)) or safetensors",
        QuotedName(fmt::format("{}.{}", module.substr(0, 100), name.substr(0, 100))));
  }
  Push(Kind::kGlobal, *callable);
}

void PickleMachine::PushGlobalOfNames() {
  const uint32_t name = Pop();
  const uint32_t module = Pop();
  PushGlobal(Expect(module, Kind::kText, "module name").text,
             Expect(name, Kind::kText, "class name").text);
}

// ('storage', type, key, location, element count[, view]).
void PickleMachine::PushStorage() {
  const std::vector<uint32_t> id = FirstItems(Pop(), 5, "storage id");
  if (id.size() < 5 || Expect(id[0], Kind::kText, "storage id").text != "storage") {
    throw bytes_.Damaged("refers to a value that is not a storage");
  }
  const int64_t type = Expect(id[1], Kind::kGlobal, "storage type").number - kStorageTypes;
  PickleStorage storage;
  storage.key = Expect(id[2], Kind::kText, "storage key").text;
  storage.count = Expect(id[4], Kind::kInt, "storage size").number;
  if (type < 0 || storage.count < 0) throw bytes_.Damaged("has a storage of unknown type or size");
  storage.type = static_cast<ElementType>(type);
  Push(Kind::kStorage, static_cast<int64_t>(graph_.storages.size()));
  graph_.storages.push_back(storage);
}

std::vector<int64_t> PickleMachine::Sizes(uint32_t index) const {
  const PickleValue& tuple = graph_.values[index];
  if (tuple.kind != Kind::kTuple && tuple.kind != Kind::kList) {
    throw bytes_.Damaged("has no sizes where they are needed");
  }
  std::vector<int64_t> sizes;
  for (uint32_t item : tuple.items) {
    sizes.push_back(Expect(item, Kind::kInt, "size").number);
    if (sizes.back() < 0) throw bytes_.Damaged("has a negative size or stride");
    if (sizes.size() > 16) throw bytes_.Damaged("has a tensor of more than 16 dimensions");
  }
  return sizes;
}

void PickleMachine::PushTensor(const std::vector<uint32_t>& arguments) {
  if (graph_.tensors.size() >= kMaxTensors)
    throw bytes_.Damaged("has more than {} tensors", kMaxTensors);
  if (arguments.size() < 4)
    throw bytes_.Damaged("has a tensor without storage, offset, size and stride");
  PickleTensor tensor;
  tensor.storage =
      static_cast<uint32_t>(Expect(arguments[0], Kind::kStorage, "tensor storage").number);
  tensor.offset = Expect(arguments[1], Kind::kInt, "tensor offset").number;
  tensor.shape = Sizes(arguments[2]);
  tensor.strides = Sizes(arguments[3]);
  if (tensor.offset < 0 || tensor.shape.size() != tensor.strides.size()) {
    throw bytes_.Damaged(
        "has a tensor whose offset is negative or whose strides do not fit its sizes");
  }
  Push(Kind::kTensor, static_cast<int64_t>(graph_.tensors.size()));
  graph_.tensors.push_back(std::move(tensor));
}

void PickleMachine::Call() {
  const uint32_t argument_tuple = Pop();
  const int64_t callable = Expect(Pop(), Kind::kGlobal, "callable").number;
  const std::vector<uint32_t> arguments = FirstItems(argument_tuple, 4, "argument list");
  switch (callable) {
    case kOrderedDict:
      if (!arguments.empty()) throw bytes_.Damaged("makes a dict from values, which is not read");
      Push(Kind::kDict);
      return;
    case kRebuildTensor:
      PushTensor(arguments);
      return;
    case kFirstArgument:
      if (arguments.empty()) throw bytes_.Damaged("calls a function without its argument");
      stack_.push_back(arguments[0]);
      return;
    case kScriptClass:
      Push(Kind::kObject);
      return;
    default:
      throw bytes_.Damaged("calls a storage type");
  }
}

void PickleMachine::Append(const std::vector<uint32_t>& items) {
  Expect(Top(), Kind::kList, "list");
  std::vector<uint32_t>& list = graph_.values[Top()].items;
  list.insert(list.end(), items.begin(), items.end());
}

void PickleMachine::SetItems(const std::vector<uint32_t>& items) {
  Expect(Top(), Kind::kDict, "dict");
  if (items.size() % 2 != 0) throw bytes_.Damaged("has a key without a value");
  std::vector<uint32_t>& dict = graph_.values[Top()].items;
  dict.insert(dict.end(), items.begin(), items.end());
}

void PickleMachine::Build() {
  const uint32_t state = Pop();
  PickleValue& target = graph_.values[Top()];
  // The state of a dict is the `_metadata` that state_dict() adds: versions, unused here.
  if (target.kind == Kind::kDict || target.kind == Kind::kTensor) return;
  if (target.kind != Kind::kObject)
    throw bytes_.Damaged("gives a state to a value that takes none");
  target.items = {state};
}

PickleGraph PickleMachine::Finish() {
  graph_.root = Pop();
  return std::move(graph_);
}

}  // namespace color3d

#include "core/weights/pickle.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <unordered_map>
#include <utility>

namespace color3d {
namespace {

using Kind = PickleValue::Kind;

// A large language model's state dict has some 1e5 values; one byte can make a value, so a pickle's
// size alone does not bound the memory.
constexpr size_t kMaxValues = 500'000;
constexpr size_t kMaxTensors = 100'000;

// The callables that are known. Storages stand for themselves and carry their number format.
enum Callable : int64_t {
  kOrderedDict,    // collections.OrderedDict()
  kRebuildTensor,  // torch._utils._rebuild_tensor_v2(storage, offset, size, stride, ...)
  kFirstArgument,  // a wrapper whose first argument is what counts
  kScriptClass,    // __torch__.X, inert
  kStorageTypes,   // + ElementType
};

std::optional<int64_t> FindCallable(std::string_view module,
                                    std::string_view name,
                                    bool allow_objects) {
  struct Known {
    std::string_view module, name;
    int64_t callable;
  };
  const auto storage = [](ElementType type) { return kStorageTypes + static_cast<int64_t>(type); };
  const Known kKnown[] = {
      {"collections", "OrderedDict", kOrderedDict},
      {"torch._utils", "_rebuild_tensor_v2", kRebuildTensor},
      {"torch._utils", "_rebuild_tensor", kRebuildTensor},
      {"torch._utils", "_rebuild_parameter", kFirstArgument},
      {"torch._utils", "_rebuild_parameter_with_state", kFirstArgument},
      {"torch", "Size", kFirstArgument},
      {"torch", "FloatStorage", storage(ElementType::kFloat32)},
      {"torch", "HalfStorage", storage(ElementType::kFloat16)},
      {"torch", "BFloat16Storage", storage(ElementType::kBfloat16)},
      {"torch", "DoubleStorage", storage(ElementType::kFloat64)},
      {"torch", "CharStorage", storage(ElementType::kInt8)},
      {"torch", "ByteStorage", storage(ElementType::kUint8)},
      {"torch", "ShortStorage", storage(ElementType::kInt16)},
      {"torch", "IntStorage", storage(ElementType::kInt32)},
      {"torch", "LongStorage", storage(ElementType::kInt64)},
      {"torch", "BoolStorage", storage(ElementType::kBool)},
  };
  for (const Known& known : kKnown) {
    if (known.module == module && known.name == name) return known.callable;
  }
  if (!allow_objects) return std::nullopt;
  if (module == "__torch__" || module.starts_with("__torch__.")) return kScriptClass;
  // TorchScript writes typed lists, dicts and devices as calls around the plain value.
  if (module == "torch.jit._pickle" || (module == "torch" && name == "device")) {
    return kFirstArgument;
  }
  return std::nullopt;
}

class Unpickler {
 public:
  Unpickler(std::string_view bytes, const ByteSource& source, bool allow_objects)
      : bytes_(bytes), source_(source), allow_objects_(allow_objects) {}

  PickleGraph Run() {
    while (!Step(Byte())) {
    }
    return std::move(graph_);
  }

 private:
  // One instruction; true after STOP.
  bool Step(uint8_t opcode);
  bool StepNumber(uint8_t opcode);
  bool StepText(uint8_t opcode);
  bool StepMemo(uint8_t opcode);
  bool StepCollect(uint8_t opcode);
  bool StepCall(uint8_t opcode);

  std::string_view Bytes(uint64_t count) {
    if (count > bytes_.size() - position_) throw Damaged("ends in the middle of an instruction");
    position_ += count;
    return bytes_.substr(position_ - count, count);
  }
  template <typename Number>
  Number Read() {
    Number value;
    std::memcpy(&value, Bytes(sizeof(value)).data(), sizeof(value));
    return value;
  }
  uint8_t Byte() { return Read<uint8_t>(); }
  std::string_view Line() {
    const size_t end = bytes_.find('\n', position_);
    if (end == std::string_view::npos) throw Damaged("ends in the middle of a name");
    const std::string_view line = Bytes(end - position_);
    ++position_;
    return line;
  }

  Error Damaged(const std::string& what) const {
    return source_.Refusal("its pickle " + what + " (byte " + std::to_string(position_) + ")");
  }

  PickleValue& At(uint32_t index) { return graph_.values[index]; }
  uint32_t Add(PickleValue value) {
    if (graph_.values.size() >= kMaxValues) {
      throw Damaged("has more than " + std::to_string(kMaxValues) + " values");
    }
    graph_.values.push_back(std::move(value));
    return static_cast<uint32_t>(graph_.values.size() - 1);
  }
  void Push(Kind kind, int64_t number = 0, std::string_view text = {}) {
    stack_.push_back(Add({kind, number, text, {}}));
  }
  void PushItems(Kind kind, std::vector<uint32_t> items) {
    stack_.push_back(Add({kind, 0, {}, std::move(items)}));
  }
  void RequireAboveMark(size_t count) const {
    if (stack_.size() - (marks_.empty() ? 0 : marks_.back()) < count) {
      throw Damaged("takes more values than there are");
    }
  }
  uint32_t Pop() {
    RequireAboveMark(1);
    const uint32_t index = stack_.back();
    stack_.pop_back();
    return index;
  }
  uint32_t Top() const {
    RequireAboveMark(1);
    return stack_.back();
  }
  std::vector<uint32_t> PopLast(size_t count) {
    RequireAboveMark(count);
    std::vector<uint32_t> items(stack_.end() - static_cast<ptrdiff_t>(count), stack_.end());
    stack_.resize(stack_.size() - count);
    return items;
  }
  std::vector<uint32_t> PopToMark() {
    if (marks_.empty()) throw Damaged("has no mark where one is needed");
    std::vector<uint32_t> items = PopLast(stack_.size() - marks_.back());
    marks_.pop_back();
    return items;
  }
  void Remember(uint32_t slot) {
    memo_[slot] = Top();
    if (memo_.size() > kMaxValues) throw Damaged("remembers too many values");
  }
  void Recall(uint32_t slot) {
    const auto found = memo_.find(slot);
    if (found == memo_.end()) throw Damaged("recalls a value that it never stored");
    stack_.push_back(found->second);
  }

  const PickleValue& Expect(uint32_t index, Kind kind, const char* what) const {
    const PickleValue& value = graph_.values[index];
    if (value.kind != kind) throw Damaged(std::string("has no ") + what + " where one is needed");
    return value;
  }
  // The first items of a tuple, at most `count`: a long tuple that is used again and again would
  // cost quadratic time if it were copied whole.
  std::vector<uint32_t> FirstItems(uint32_t index, size_t count, const char* what) const {
    const std::vector<uint32_t>& items = Expect(index, Kind::kTuple, what).items;
    return {items.begin(), items.begin() + static_cast<ptrdiff_t>(std::min(count, items.size()))};
  }
  std::vector<int64_t> Sizes(uint32_t index) const;
  void PushGlobal(std::string_view module, std::string_view name);
  void PushStorage();
  void PushTensor(const std::vector<uint32_t>& arguments);
  void Call(int64_t callable, uint32_t argument_tuple);
  void SetItems(std::vector<uint32_t> items);
  void Build();

  std::string_view bytes_;
  const ByteSource& source_;
  const bool allow_objects_;
  size_t position_ = 0;
  PickleGraph graph_;
  std::vector<uint32_t> stack_;
  std::vector<size_t> marks_;
  std::unordered_map<uint32_t, uint32_t> memo_;
};

bool Unpickler::Step(uint8_t opcode) {
  switch (opcode) {
    case 0x80:  // PROTO
      if (Byte() > 5) throw Damaged("is of a later protocol than 5");
      return false;
    case 0x95:  // FRAME: only a hint for readers
      Read<uint64_t>();
      return false;
    case '.':  // STOP
      graph_.root = Pop();
      return true;
    default:
      break;
  }
  if (StepNumber(opcode) || StepText(opcode) || StepMemo(opcode) || StepCollect(opcode) ||
      StepCall(opcode)) {
    return false;
  }
  throw Damaged("uses the instruction " + std::to_string(opcode) +
                ", which no state dict needs; save the state dict alone with torch.save");
}

bool Unpickler::StepNumber(uint8_t opcode) {
  switch (opcode) {
    case 'N':
      Push(Kind::kNone);
      return true;
    case 0x88:  // NEWTRUE
    case 0x89:  // NEWFALSE
      Push(Kind::kBool, opcode == 0x88);
      return true;
    case 'J':  // BININT
      Push(Kind::kInt, Read<int32_t>());
      return true;
    case 'K':  // BININT1
      Push(Kind::kInt, Byte());
      return true;
    case 'M':  // BININT2
      Push(Kind::kInt, Read<uint16_t>());
      return true;
    case 0x8a: {  // LONG1: little-endian two's complement
      const std::string_view digits = Bytes(Byte());
      if (digits.size() > 8) throw Damaged("has a number of more than 64 bits");
      uint64_t number = !digits.empty() && (digits.back() & 0x80) ? ~uint64_t{0} : 0;
      std::memcpy(&number, digits.data(), digits.size());
      Push(Kind::kInt, static_cast<int64_t>(number));
      return true;
    }
    case 'G':  // BINFLOAT
      Bytes(8);
      Push(Kind::kFloat);
      return true;
    default:
      return false;
  }
}

bool Unpickler::StepText(uint8_t opcode) {
  switch (opcode) {
    case 'X':  // BINUNICODE
    case 'T':  // BINSTRING
    case 'B':  // BINBYTES
      Push(Kind::kText, 0, Bytes(Read<uint32_t>()));
      return true;
    case 0x8c:  // SHORT_BINUNICODE
    case 'U':   // SHORT_BINSTRING
    case 'C':   // SHORT_BINBYTES
      Push(Kind::kText, 0, Bytes(Byte()));
      return true;
    case 0x8d:  // BINUNICODE8
      Push(Kind::kText, 0, Bytes(Read<uint64_t>()));
      return true;
    default:
      return false;
  }
}

bool Unpickler::StepMemo(uint8_t opcode) {
  switch (opcode) {
    case 'q':  // BINPUT
      Remember(Byte());
      return true;
    case 'r':  // LONG_BINPUT
      Remember(Read<uint32_t>());
      return true;
    case 0x94:  // MEMOIZE
      Remember(static_cast<uint32_t>(memo_.size()));
      return true;
    case 'h':  // BINGET
      Recall(Byte());
      return true;
    case 'j':  // LONG_BINGET
      Recall(Read<uint32_t>());
      return true;
    default:
      return false;
  }
}

bool Unpickler::StepCollect(uint8_t opcode) {
  switch (opcode) {
    case '(':  // MARK
      marks_.push_back(stack_.size());
      return true;
    case '}':  // EMPTY_DICT
      Push(Kind::kDict);
      return true;
    case ']':  // EMPTY_LIST
      Push(Kind::kList);
      return true;
    case ')':  // EMPTY_TUPLE
      Push(Kind::kTuple);
      return true;
    case 't':  // TUPLE
      PushItems(Kind::kTuple, PopToMark());
      return true;
    case 0x85:  // TUPLE1
    case 0x86:  // TUPLE2
    case 0x87:  // TUPLE3
      PushItems(Kind::kTuple, PopLast(opcode - 0x84));
      return true;
    case 's':  // SETITEM
      SetItems(PopLast(2));
      return true;
    case 'u':  // SETITEMS
      SetItems(PopToMark());
      return true;
    case 'a':    // APPEND
    case 'e': {  // APPENDS
      const std::vector<uint32_t> items = opcode == 'a' ? PopLast(1) : PopToMark();
      Expect(Top(), Kind::kList, "list");
      std::vector<uint32_t>& list = At(Top()).items;
      list.insert(list.end(), items.begin(), items.end());
      return true;
    }
    default:
      return false;
  }
}

bool Unpickler::StepCall(uint8_t opcode) {
  switch (opcode) {
    case 'c': {  // GLOBAL
      const std::string_view module = Line();
      PushGlobal(module, Line());
      return true;
    }
    case 0x93: {  // STACK_GLOBAL
      const uint32_t name = Pop();
      const uint32_t module = Pop();
      PushGlobal(Expect(module, Kind::kText, "module name").text,
                 Expect(name, Kind::kText, "class name").text);
      return true;
    }
    case 'Q':  // BINPERSID
      PushStorage();
      return true;
    case 'R':     // REDUCE
    case 0x81: {  // NEWOBJ
      const uint32_t arguments = Pop();
      const int64_t callable = Expect(Pop(), Kind::kGlobal, "callable").number;
      Call(callable, arguments);
      return true;
    }
    case 'b':  // BUILD
      Build();
      return true;
    default:
      return false;
  }
}

void Unpickler::PushGlobal(std::string_view module, std::string_view name) {
  const std::optional<int64_t> callable = FindCallable(module, name, allow_objects_);
  if (!callable) {
    throw source_.Refusal(
        "it asks to run " +
        QuotedName(std::string(module.substr(0, 100)) + "." + std::string(name.substr(0, 100))) +
        ", which is refused: only plain tensors are read; save the model's "
        "state dict (torch.save(model.state_dict(), ...)) or safetensors");
  }
  Push(Kind::kGlobal, *callable);
}

// ('storage', type, key, location, element count[, view]).
void Unpickler::PushStorage() {
  const std::vector<uint32_t> id = FirstItems(Pop(), 5, "storage id");
  if (id.size() < 5 || Expect(id[0], Kind::kText, "storage id").text != "storage") {
    throw Damaged("refers to something that is no storage");
  }
  const int64_t type = Expect(id[1], Kind::kGlobal, "storage type").number - kStorageTypes;
  PickleStorage storage;
  storage.key = Expect(id[2], Kind::kText, "storage key").text;
  storage.count = Expect(id[4], Kind::kInt, "storage size").number;
  if (type < 0 || storage.count < 0) throw Damaged("has a storage of unknown type or size");
  storage.type = static_cast<ElementType>(type);
  Push(Kind::kStorage, static_cast<int64_t>(graph_.storages.size()));
  graph_.storages.push_back(storage);
}

std::vector<int64_t> Unpickler::Sizes(uint32_t index) const {
  const PickleValue& tuple = graph_.values[index];
  if (tuple.kind != Kind::kTuple && tuple.kind != Kind::kList) {
    throw Damaged("has no sizes where they are needed");
  }
  std::vector<int64_t> sizes;
  for (uint32_t item : tuple.items) {
    sizes.push_back(Expect(item, Kind::kInt, "size").number);
    if (sizes.back() < 0) throw Damaged("has a negative size or stride");
    if (sizes.size() > 16) throw Damaged("has a tensor of more than 16 dimensions");
  }
  return sizes;
}

void Unpickler::PushTensor(const std::vector<uint32_t>& arguments) {
  if (graph_.tensors.size() >= kMaxTensors) throw Damaged("has more than 100000 tensors");
  if (arguments.size() < 4) throw Damaged("has a tensor without storage, offset, size and stride");
  PickleTensor tensor;
  tensor.storage =
      static_cast<uint32_t>(Expect(arguments[0], Kind::kStorage, "tensor storage").number);
  tensor.offset = Expect(arguments[1], Kind::kInt, "tensor offset").number;
  tensor.shape = Sizes(arguments[2]);
  tensor.strides = Sizes(arguments[3]);
  if (tensor.offset < 0 || tensor.shape.size() != tensor.strides.size()) {
    throw Damaged("has a tensor whose offset is negative or whose strides do not fit its sizes");
  }
  Push(Kind::kTensor, static_cast<int64_t>(graph_.tensors.size()));
  graph_.tensors.push_back(std::move(tensor));
}

void Unpickler::Call(int64_t callable, uint32_t argument_tuple) {
  const std::vector<uint32_t> arguments = FirstItems(argument_tuple, 4, "argument list");
  switch (callable) {
    case kOrderedDict:
      if (!arguments.empty()) throw Damaged("makes a dict from values, which is not read");
      Push(Kind::kDict);
      return;
    case kRebuildTensor:
      PushTensor(arguments);
      return;
    case kFirstArgument:
      if (arguments.empty()) throw Damaged("calls a function without its argument");
      stack_.push_back(arguments[0]);
      return;
    case kScriptClass:
      Push(Kind::kObject);
      return;
    default:
      throw Damaged("calls a storage type");
  }
}

void Unpickler::SetItems(std::vector<uint32_t> items) {
  Expect(Top(), Kind::kDict, "dict");
  if (items.size() % 2 != 0) throw Damaged("has a key without a value");
  std::vector<uint32_t>& dict = At(Top()).items;
  dict.insert(dict.end(), items.begin(), items.end());
}

void Unpickler::Build() {
  const uint32_t state = Pop();
  PickleValue& target = At(Top());
  // A dict's state is the `_metadata` that state_dict() adds: versions, of no use here.
  if (target.kind == Kind::kDict || target.kind == Kind::kTensor) return;
  if (target.kind != Kind::kObject) throw Damaged("gives a state to a value that takes none");
  target.items = {state};
}

}  // namespace

const PickleValue* PickleGraph::Find(const PickleValue& dict, std::string_view key) const {
  if (dict.kind != Kind::kDict) return nullptr;
  for (size_t i = 0; i + 1 < dict.items.size(); i += 2) {
    const PickleValue& name = values[dict.items[i]];
    if (name.kind == Kind::kText && name.text == key) return &values[dict.items[i + 1]];
  }
  return nullptr;
}

PickleGraph ReadPickle(std::string_view bytes, const ByteSource& source, bool allow_objects) {
  return Unpickler(bytes, source, allow_objects).Run();
}

}  // namespace color3d

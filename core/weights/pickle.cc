#include "core/weights/pickle.h"

#include <cstring>

#include "core/weights/pickle_bytes.h"
#include "core/weights/pickle_machine.h"

// Instructions are named as in Python's pickletools.py.
namespace color3d {
namespace {

using Kind = PickleValue::Kind;

class Unpickler {
 public:
  Unpickler(std::string_view bytes, const ByteSource& source, bool allow_objects)
      : bytes_(bytes, source), machine_(bytes_, allow_objects) {}

  PickleGraph Run() {
    while (!Step(bytes_.ReadByte())) {
    }
    return machine_.Finish();
  }

 private:
  // Executes one instruction. Returns true after STOP.
  bool Step(uint8_t opcode);
  // Returns false if the instruction is of another kind.
  bool StepNumber(uint8_t opcode);
  bool StepText(uint8_t opcode);
  bool StepMemo(uint8_t opcode);
  bool StepCollect(uint8_t opcode);
  bool StepCall(uint8_t opcode);

  PickleBytes bytes_;
  PickleMachine machine_;
};

bool Unpickler::Step(uint8_t opcode) {
  switch (opcode) {
    case 0x80:  // PROTO
      if (bytes_.ReadByte() > 5) throw bytes_.Damaged("is of a later protocol than 5");
      return false;
    case 0x95:  // FRAME: only a hint for readers
      bytes_.Read<uint64_t>();
      return false;
    case '.':  // STOP
      return true;
    default:
      break;
  }
  if (StepNumber(opcode) || StepText(opcode) || StepMemo(opcode) || StepCollect(opcode) ||
      StepCall(opcode)) {
    return false;
  }
  throw bytes_.Damaged(
      "uses the instruction {}, which no state dict needs; save the state dict alone with "
      "torch.save",
      opcode);
}

bool Unpickler::StepNumber(uint8_t opcode) {
  switch (opcode) {
    case 'N':
      machine_.Push(Kind::kNone);
      return true;
    case 0x88:  // NEWTRUE
    case 0x89:  // NEWFALSE
      machine_.Push(Kind::kBool, opcode == 0x88);
      return true;
    case 'J':  // BININT
      machine_.Push(Kind::kInt, bytes_.Read<int32_t>());
      return true;
    case 'K':  // BININT1
      machine_.Push(Kind::kInt, bytes_.ReadByte());
      return true;
    case 'M':  // BININT2
      machine_.Push(Kind::kInt, bytes_.Read<uint16_t>());
      return true;
    case 0x8a: {  // LONG1: little-endian two's complement
      const std::string_view digits = bytes_.Take(bytes_.ReadByte());
      if (digits.size() > 8) throw bytes_.Damaged("has a number of more than 64 bits");
      uint64_t number = !digits.empty() && (digits.back() & 0x80) ? ~uint64_t{0} : 0;
      std::memcpy(&number, digits.data(), digits.size());
      machine_.Push(Kind::kInt, static_cast<int64_t>(number));
      return true;
    }
    case 'G':  // BINFLOAT
      bytes_.Take(8);
      machine_.Push(Kind::kFloat);
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
      machine_.Push(Kind::kText, 0, bytes_.Take(bytes_.Read<uint32_t>()));
      return true;
    case 0x8c:  // SHORT_BINUNICODE
    case 'U':   // SHORT_BINSTRING
    case 'C':   // SHORT_BINBYTES
      machine_.Push(Kind::kText, 0, bytes_.Take(bytes_.ReadByte()));
      return true;
    case 0x8d:  // BINUNICODE8
      machine_.Push(Kind::kText, 0, bytes_.Take(bytes_.Read<uint64_t>()));
      return true;
    default:
      return false;
  }
}

bool Unpickler::StepMemo(uint8_t opcode) {
  switch (opcode) {
    case 'q':  // BINPUT
      machine_.Remember(bytes_.ReadByte());
      return true;
    case 'r':  // LONG_BINPUT
      machine_.Remember(bytes_.Read<uint32_t>());
      return true;
    case 0x94:  // MEMOIZE
      machine_.RememberNext();
      return true;
    case 'h':  // BINGET
      machine_.Recall(bytes_.ReadByte());
      return true;
    case 'j':  // LONG_BINGET
      machine_.Recall(bytes_.Read<uint32_t>());
      return true;
    default:
      return false;
  }
}

bool Unpickler::StepCollect(uint8_t opcode) {
  switch (opcode) {
    case '(':  // MARK
      machine_.Mark();
      return true;
    case '}':  // EMPTY_DICT
      machine_.Push(Kind::kDict);
      return true;
    case ']':  // EMPTY_LIST
      machine_.Push(Kind::kList);
      return true;
    case ')':  // EMPTY_TUPLE
      machine_.Push(Kind::kTuple);
      return true;
    case 't':  // TUPLE
      machine_.PushItems(Kind::kTuple, machine_.PopToMark());
      return true;
    case 0x85:  // TUPLE1
    case 0x86:  // TUPLE2
    case 0x87:  // TUPLE3
      machine_.PushItems(Kind::kTuple, machine_.PopLast(opcode - 0x84));
      return true;
    case 's':  // SETITEM
      machine_.SetItems(machine_.PopLast(2));
      return true;
    case 'u':  // SETITEMS
      machine_.SetItems(machine_.PopToMark());
      return true;
    case 'a':  // APPEND
      machine_.Append(machine_.PopLast(1));
      return true;
    case 'e':  // APPENDS
      machine_.Append(machine_.PopToMark());
      return true;
    default:
      return false;
  }
}

bool Unpickler::StepCall(uint8_t opcode) {
  switch (opcode) {
    case 'c': {  // GLOBAL
      const std::string_view module = bytes_.ReadLine();
      machine_.PushGlobal(module, bytes_.ReadLine());
      return true;
    }
    case 0x93:  // STACK_GLOBAL
      machine_.PushGlobalOfNames();
      return true;
    case 'Q':  // BINPERSID
      machine_.PushStorage();
      return true;
    case 'R':   // REDUCE
    case 0x81:  // NEWOBJ
      machine_.Call();
      return true;
    case 'b':  // BUILD
      machine_.Build();
      return true;
    default:
      return false;
  }
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

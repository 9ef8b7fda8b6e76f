// A simulated device of values that no person chose: every kind, table and order. What is written
// is what is read, and nothing else changes. A trial that fails names its seed.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <map>
#include <random>
#include <string>
#include <vector>

#include "spindle/catalogue/value.hpp"
#include "spindle/modbus/pdu.hpp"
#include "spindle/sim/simulated_tool.hpp"

using namespace spindle;
using namespace spindle::catalogue;
using modbus::Pdu;
using modbus::RegisterTable;

namespace {

/// The same numbers on every machine.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  std::uint64_t between(std::uint64_t first, std::uint64_t last) {
    return first + engine_() % (last - first + 1);
  }
  bool one_in(std::uint64_t count) { return between(1, count) == 1; }
  template <typename Item>
  Item of(const std::vector<Item>& items) {
    return items[between(0, items.size() - 1)];
  }
  template <typename Number>
  Number number(std::uint64_t first, std::uint64_t last) {
    return static_cast<Number>(between(first, last));
  }

 private:
  std::mt19937_64 engine_;
};

Encoding encoding_of(Dice& dice) {
  Encoding made;
  made.kind = dice.of<Kind>({Kind::u16, Kind::i16, Kind::u32, Kind::i32, Kind::u64, Kind::i64,
                             Kind::f32, Kind::f64, Kind::bcd, Kind::text, Kind::date});
  made.word_order = dice.of<WordOrder>({WordOrder::big, WordOrder::little});
  made.byte_order = dice.of<ByteOrder>({ByteOrder::big, ByteOrder::little});
  made.padding = dice.of<Padding>({Padding::nul, Padding::space});
  made.date = dice.of<DateLayout>(
      {DateLayout::registers, DateLayout::long_year, DateLayout::bytes, DateLayout::unix_time});
  if (made.kind == Kind::text) {
    made.length = dice.number<std::uint16_t>(1, 20);
    made.packing = dice.of<Packing>({Packing::two, Packing::low});
  }
  if (made.kind == Kind::bcd) made.length = dice.number<std::uint16_t>(1, 8);
  if (dice.one_in(4)) made.count = dice.number<std::uint16_t>(2, 4);
  if (dice.one_in(2)) made.scale = Decimal(1, -dice.number<int>(0, 3));
  if (dice.one_in(4)) made.offset = Decimal(dice.number<int>(0, 1000) - 500, -1);
  if (dice.one_in(6) && !made.is_float()) {
    made.scale = Decimal(20);
    made.divisor = 32768;
  }
  return made;
}

/// Some bits of a register or of two, from the lowest on.
std::vector<Encoding> parts_of(Dice& dice) {
  if (dice.one_in(3)) {
    return {{.kind = Kind::u8, .slice = {0, 8}}, {.kind = Kind::i8, .slice = {8, 8}}};
  }
  std::vector<Encoding> parts;
  const bool is_wide = dice.one_in(3);
  for (unsigned first = 0; first < (is_wide ? 32U : 16U);) {
    const auto width = dice.number<std::uint8_t>(1, 16 - first % 16);
    const bool is_signed = width > 1 && dice.one_in(2);
    Encoding part{
        .kind = is_wide ? (is_signed ? Kind::i32 : Kind::u32) : (is_signed ? Kind::i16 : Kind::u16),
        .slice = {static_cast<std::uint8_t>(first), width}};
    if (!is_wide && dice.one_in(4)) part.kind = Kind::bit;
    parts.push_back(part);
    first += width;
  }
  return parts;
}

/// Random bits that mean something; empty when there is no luck.
std::optional<Value> any_value(Dice& dice, const Parameter& parameter) {
  if (parameter.encoding.kind == Kind::text || parameter.encoding.kind == Kind::date) {
    std::string all;
    for (unsigned i = 0; i < parameter.encoding.count; ++i) {
      if (i > 0) all += ',';
      all += parameter.encoding.kind == Kind::text
                 ? std::string(dice.between(0, parameter.encoding.length), 'x')
                 : fmt::format("20{}-12-31 23:59:0{}", dice.between(10, 99), dice.between(0, 9));
    }
    auto value = parse_value(parameter, all);
    return value ? std::optional(std::move(*value)) : std::nullopt;
  }
  for (int tries = 0; tries < 50; ++tries) {
    Registers bits(register_count(parameter.encoding));
    const std::uint64_t highest = modbus::holds_bits(parameter.table)    ? 1
                                  : parameter.encoding.kind == Kind::bcd ? 9
                                                                         : 0xFFFF;
    for (auto& word : bits) word = dice.number<std::uint16_t>(0, highest);
    const auto value = decode(parameter, bits);
    const auto is_good = [&](const Value& one) {
      return one.content != Content::none && check_range(parameter, one) &&
             (one.content == Content::list ||
              (encode(parameter, one, bits).has_value() || parameter.encoding.count > 1));
    };
    if (!value || !is_good(*value)) continue;
    if (!std::all_of(value->elements.begin(), value->elements.end(), is_good)) continue;
    const auto registers = encode(parameter, *value, bits);
    if (registers && decode(parameter, *registers) == *value) return *value;
  }
  return std::nullopt;
}

class Trial {
 public:
  explicit Trial(std::uint64_t seed) : dice_(seed) {
    profile_.link.max_write = dice_.number<std::uint16_t>(1, 123);
    if (dice_.one_in(3)) profile_.link.write_function = dice_.of<std::uint8_t>({6, 16});
    add("lock", RegisterTable::holding, {}, 1);
    for (const RegisterTable table : {RegisterTable::holding, RegisterTable::input,
                                      RegisterTable::coil, RegisterTable::discrete}) {
      fill(table);
    }
    if (dice_.one_in(2)) profile_.unlock = UnlockSpec{"lock", 7, {}};
    profile_.parameters = parameters_;
    add_actions();
    add_run();
    tool_ = sim::make_simulated_bus(profile_, {}, {});
    tool_->advance(now_);
  }

  void run() {
    for (const Parameter& parameter : parameters_) {
      CAPTURE(parameter.name.to_string());
      const auto first = value_of(parameter);
      REQUIRE(first.has_value());
      if (!is_command(parameter)) CHECK(first->content != Content::none);
    }
    if (profile_.unlock) {
      for (const Parameter& parameter : parameters_) {
        const bool is_locked = parameter.name != "lock" && parameter.access == Access::read_write;
        CAPTURE(parameter.name.to_string());
        if (!is_locked || parameter.encoding.is_part()) continue;
        CHECK(write(parameter, read(parameter)) == 3);
      }
      CHECK(write(parameters_.front(), {7}) == 0);
    }
    for (int round = 0; round < 2; ++round) {
      for (const Parameter& parameter : parameters_) write_any(parameter);
    }
    check_all();
    happen();
    check_all();
    ask_anything();
  }

 private:
  void add(const std::string& name, RegisterTable table, const Encoding& encoding,
           std::uint16_t address) {
    Parameter made;
    made.name = name;
    made.table = table;
    made.address = {address};
    made.encoding = encoding;
    const bool is_writable = modbus::is_writable(table) && (name == "lock" || !dice_.one_in(4));
    made.access = is_writable ? Access::read_write : Access::read_only;
    if (is_writable && encoding.is_integer() && encoding.slice.is_whole() && dice_.one_in(4) &&
        name != "lock") {
      auto low = any_value(dice_, made);
      auto high = any_value(dice_, made);
      if (low && high && low->is_number() && high->is_number()) {
        if (high->number < low->number) std::swap(low, high);
        made.range = {low->number, high->number};
        if (dice_.one_in(2)) made.default_value = high->number;
      }
    }
    const bool may_be_null = is_writable && name != "lock" && encoding.is_integer() &&
                             encoding.kind != Kind::bit && encoding.slice.width != 1;
    if (may_be_null && dice_.one_in(6)) made.nulls = {0, 1};
    if (is_writable && !encoding.is_part() && dice_.one_in(5) && name != "lock") {
      made.write_address = modbus::RegisterAddress{static_cast<std::uint16_t>(address + 2000)};
    }
    parameters_.push_back(made);
  }

  void fill(RegisterTable table) {
    std::uint16_t address = 2;
    for (std::uint64_t i = dice_.between(1, 12); i > 0; --i) {
      const auto name = [&](std::size_t part) {
        return fmt::format("{}.{}.{}", to_text(table), address, part);
      };
      std::vector<Encoding> encodings = {encoding_of(dice_)};
      if (modbus::holds_bits(table)) {
        encodings = {{.kind = Kind::bit, .count = dice_.number<std::uint16_t>(1, 30)}};
      } else if (dice_.one_in(3)) {
        encodings = parts_of(dice_);
      }
      std::uint16_t size = 0;
      for (std::size_t part = 0; part < encodings.size(); ++part) {
        add(name(part), table, encodings[part], address);
        size = std::max(size, register_count(encodings[part]));
      }
      address = static_cast<std::uint16_t>(address + size + dice_.between(0, 2));
    }
  }

  Text any_name(Access access) {
    std::vector<Text> names = {{}};
    for (const Parameter& parameter : parameters_) {
      if (parameter.access == access && parameter.name != "lock") names.push_back(parameter.name);
    }
    return dice_.of(names);
  }

  void add_actions() {
    std::vector<Action> actions;
    for (std::uint64_t i = dice_.between(0, 4); i > 0; --i) {
      Action action;
      action.name = fmt::format("action-{}", i);
      action.table = dice_.of<RegisterTable>({RegisterTable::holding, RegisterTable::coil});
      action.address = {dice_.number<std::uint16_t>(5000, 5004)};
      if (action.table == RegisterTable::coil) action.encoding.kind = Kind::bit;
      action.value = 1;
      if (dice_.one_in(2)) action.stop_value = 0;
      action.confirm = any_name(Access::read_only);
      action.busy = std::chrono::milliseconds(dice_.between(0, 500));
      actions.push_back(action);
    }
    profile_.actions = actions;
    if (dice_.one_in(2)) profile_.link.busy = {6};
    if (!actions.empty()) profile_.alarm_reset = actions.front().name;
  }

  void add_run() {
    const auto shown = [this] { return any_name(Access::read_only); };
    MonitorSpec monitor{.status = shown(),
                        .running = 0,
                        .command_speed = shown(),
                        .feedback_speed = shown(),
                        .alarm = shown(),
                        .warning = shown()};
    switch (dice_.between(0, 2)) {
      case 0:
        return;
      case 1:
        profile_.run = RunSpec{StartActionSpec{.start = "action-1", .alarm = shown()}};
        return;
      default:
        profile_.run = RunSpec{CommandRegisterSpec{.command = any_name(Access::read_write),
                                                   .forward = 1,
                                                   .stop_register = any_name(Access::read_write),
                                                   .set_point = any_name(Access::read_write),
                                                   .monitor = std::move(monitor)}};
    }
  }

  Pdu ask(const Pdu& request) {
    return tool_->answer(sim::ConnectionId{1}, {1}, request, now_).value();
  }
  int exception(const Pdu& request) { return modbus::exception_of(ask(request)).value_or(0); }

  Registers read(const Parameter& parameter) {
    const Pdu request = modbus::read_request(parameter.table, parameter.address,
                                             register_count(parameter.encoding));
    const Pdu response = ask(request);
    CHECK(modbus::fit(request, response) == modbus::Fit::answer);
    return modbus::registers_of(request, response);
  }
  std::optional<Value> value_of(const Parameter& parameter) {
    const auto value = decode(parameter, read(parameter));
    return value ? std::optional(*value) : std::nullopt;
  }

  [[nodiscard]] bool writes_several() const {
    const auto& function = profile_.link.write_function;
    return function ? *function == 16 : profile_.link.max_write > 1;
  }
  [[nodiscard]] bool is_written_at_once(const Parameter& parameter) const {
    const std::size_t size = register_count(parameter.encoding);
    return parameter.table == RegisterTable::coil || size == 1 ||
           (writes_several() && size <= profile_.link.max_write);
  }

  /// The exception; 0: none.
  int write(const Parameter& parameter, const Registers& registers) {
    modbus::RegisterAddress at = parameter.write_address.value_or(parameter.address);
    if (parameter.table == RegisterTable::coil) {
      return exception(registers.size() == 1 && dice_.one_in(2)
                           ? modbus::write_coil_request(at, registers.front())
                           : modbus::write_coils_request(at, registers));
    }
    const bool only_single = profile_.link.write_function == std::uint8_t{6};
    const bool is_multiple =
        !only_single && (registers.size() > 1 || profile_.link.write_function.has_value());
    if (is_multiple && writes_several() && registers.size() <= profile_.link.max_write) {
      return exception(modbus::write_request(at, RegisterView(registers)));
    }
    for (const std::uint16_t word : registers) {
      const bool by_ten = profile_.link.write_function == std::uint8_t{16};
      const int refused = exception(by_ten ? modbus::write_request(at, RegisterView(&word, 1))
                                           : modbus::write_request(at, word));
      if (refused != 0) return refused;
      ++at.value;
    }
    return 0;
  }

  void write_any(const Parameter& parameter) {
    CAPTURE(parameter.name.to_string());
    if (parameter.access == Access::read_only || parameter.name == "lock") return;
    const bool is_limited = parameter.range.minimum.has_value();
    if (is_limited && !is_written_at_once(parameter)) return;
    const auto value = any_value(dice_, parameter);
    if (!value) return;
    const auto registers = encode(parameter, *value, read(parameter));
    REQUIRE(registers.has_value());
    CHECK(write(parameter, *registers) == 0);
    values_[parameter.name.to_string()] = *value;
    CHECK(value_of(parameter) == *value);
    if (is_limited) check_limits(parameter, *value);
  }

  void check_limits(const Parameter& parameter, const Value& value) {
    Parameter free = parameter;
    free.range = {};
    const auto other = any_value(dice_, free);
    const auto fits = [&](const Value& one) { return check_range(parameter, one).has_value(); };
    if (!other) return;
    if (fits(*other) && std::all_of(other->elements.begin(), other->elements.end(), fits)) return;
    CHECK(write(parameter, *encode(free, *other)) == 3);
    CHECK(value_of(parameter) == value);
  }

  void check_all() {
    for (const Parameter& parameter : parameters_) {
      const auto written = values_.find(parameter.name.to_string());
      CAPTURE(parameter.name.to_string());
      if (written != values_.end()) CHECK(value_of(parameter) == written->second);
    }
  }

  /// Whatever happens, it answers.
  void happen() {
    for (const Action& action : profile_.actions) {
      if (action.table == RegisterTable::coil) {
        exception(modbus::write_coil_request(action.address, 1));
      } else {
        exception(modbus::write_request(action.address, 1));
      }
      now_ += std::chrono::milliseconds(700);
    }
    tool_->raise_alarm(1, 7, now_);
    tool_->raise_warning(1, 8, now_);
    tool_->happen(EventKind::fastening_ok, now_);
    tool_->operator_rundown(sim::Rundown::ok, now_);
    now_ += std::chrono::seconds(5);
    tool_->reboot(now_);
    for (const Parameter& parameter : parameters_) {
      if (is_command(parameter)) values_.erase(parameter.name.to_string());
    }
  }
  void ask_anything() {
    for (int i = 0; i < 100; ++i) {
      Pdu request{.function = dice_.number<std::uint8_t>(1, 17), .data = {}};
      put_u16(request.data, dice_.number<std::uint16_t>(0, dice_.one_in(2) ? 40 : 65535));
      const auto count = dice_.number<std::uint16_t>(0, dice_.one_in(2) ? 20 : 65535);
      put_u16(request.data, count);
      const bool is_multiple = request.function == 15 || request.function == 16;
      const std::size_t bytes = is_multiple ? (dice_.one_in(3) ? 7 : count % 100 * 2U) : 0;
      if (is_multiple) request.data.push_back(static_cast<std::uint8_t>(bytes));
      for (std::size_t n = 0; n < bytes; ++n) {
        request.data.push_back(dice_.number<std::uint8_t>(0, 255));
      }
      const Pdu response = ask(request);
      const bool fits = modbus::exception_of(response).has_value() ||
                        modbus::fit(request, response) == modbus::Fit::answer;
      CHECK(fits);
    }
  }
  [[nodiscard]] bool is_command(const Parameter& parameter) const {
    return profile_.commands_motion(parameter);
  }

  Dice dice_;
  Profile profile_ = {};
  std::vector<Parameter> parameters_ = {};
  std::unique_ptr<sim::SimulatedBus> tool_ = {};
  std::map<std::string, Value> values_ = {};
  TimePoint now_ = TimePoint() + std::chrono::hours(1);
};

}  // namespace

TEST_CASE("simulated values of any kind read back as they were written") {
  constexpr std::uint64_t trials = 300;
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    CAPTURE(seed);
    Trial(seed).run();
  }
}

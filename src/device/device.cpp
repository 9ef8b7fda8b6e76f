#include "spindle/device/device.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "device/hints.hpp"
#include "device/register_range.hpp"
#include "spindle/catalogue/meaning.hpp"

namespace spindle::device {
namespace {

/// Which tool it is, as a profile of the user's own names it.
std::string text_of(const catalogue::Identity& identity) {
  return fmt::format("serial {}, firmware {}", identity.serial, identity.firmware.value_or(0));
}

/// How often the last event is read before giving up on one that stands still meanwhile.
constexpr int max_event_reads = 5;

using catalogue::Area;
using catalogue::Parameter;
using catalogue::Value;
using link::RegisterRange;
using modbus::FunctionCode;

RegisterRange range_at(const Parameter& parameter, modbus::RegisterAddress address) {
  return {parameter.table, address.value, catalogue::register_count(parameter.encoding)};
}

/// The parts of an area that are left when the registers said to be absent are taken out.
void append_without_absent(const Area& area, const std::vector<Area>& absent,
                           std::vector<RegisterRange>& ranges) {
  std::uint32_t from = area.from;
  const auto append = [&](std::uint32_t until) {
    if (from < until) {
      ranges.push_back(
          {area.table, static_cast<std::uint16_t>(from), static_cast<std::uint16_t>(until - from)});
    }
  };
  for (const Area& hole : absent) {
    if (hole.table != area.table || hole.to < from || hole.from > area.to) continue;
    append(hole.from);
    from = std::uint32_t{hole.to} + 1;
  }
  append(std::uint32_t{area.to} + 1);
}

bool is_said_absent(const Parameter& parameter, const catalogue::Profile& profile) {
  const auto& absent = profile.link.absent;
  return std::any_of(absent.begin(), absent.end(), [&](const Area& area) {
    return area.table == parameter.table && area.from <= parameter.address.value &&
           parameter.address.value <= area.to;
  });
}

/// The read whose answer has this shape.
RegisterRange read_of(const link::SpontaneousShape& shape) {
  const auto holding = static_cast<std::uint8_t>(modbus::FunctionCode::read_holding_registers);
  return {shape.function == holding ? modbus::RegisterTable::holding : modbus::RegisterTable::input,
          0, static_cast<std::uint16_t>(shape.byte_count / 2)};
}

link::ReadLimits read_limits(const catalogue::Profile& profile,
                             const std::vector<link::SpontaneousShape>& unasked) {
  link::ReadLimits limits;
  // Of what is not known nothing says where registers are, and a wrong value is worse than a
  // refused one.
  limits.neighbours =
      profile.id.empty() ? link::Neighbours::anywhere : link::Neighbours::contiguous;
  limits.max_read = profile.link.max_read;
  limits.max_read_bits = profile.link.max_read_bits;
  limits.max_gap = profile.link.max_gap;
  std::vector<Area> absent(profile.link.absent.begin(), profile.link.absent.end());
  for (const Parameter& parameter : profile.parameters) {
    if (parameter.reading != catalogue::Reading::consumes) continue;
    const RegisterRange alone = range_of(parameter);
    absent.push_back({.table = alone.table,
                      .from = alone.first,
                      .to = static_cast<std::uint16_t>(alone.first + alone.count - 1)});
  }
  std::sort(absent.begin(), absent.end(),
            [](const Area& a, const Area& b) { return a.from < b.from; });
  for (const Area& area : profile.link.contiguous) {
    append_without_absent(area, absent, limits.contiguous);
  }
  for (const Area& area : absent) {
    limits.absent.push_back(
        {area.table, area.from, static_cast<std::uint16_t>(area.to - area.from + 1)});
  }
  if (catalogue::sends_unasked(profile)) {
    for (const auto& shape : shapes_of(*profile.events)) {
      limits.forbidden_shapes.push_back(read_of(shape));
    }
  }
  for (const catalogue::UnaskedFrame& frame : profile.link.unasked) {
    limits.forbidden_shapes.push_back(read_of(shape_of(frame)));
  }
  for (const link::SpontaneousShape& shape : unasked) {
    limits.forbidden_shapes.push_back(read_of(shape));
  }
  if (profile.refusals) {
    if (const auto code = profile.find(profile.refusals->parameter)) {
      limits.refusal = range_of(*code);
    }
  }
  return limits;
}

/// What no trace shows.
std::vector<RegisterRange> secrets_of(const catalogue::Profile& profile) {
  std::vector<RegisterRange> secrets;
  for (const Parameter& parameter : profile.parameters) {
    if (parameter.secrecy == catalogue::Secrecy::open) continue;
    secrets.push_back(range_of(parameter));
    if (parameter.write_address) secrets.push_back(range_at(parameter, *parameter.write_address));
  }
  return secrets;
}

/// A profile without rules gives more than the standard asks for, because there are devices that do
/// not hear what the standard allows.
Duration gap_of(const catalogue::SerialSpec& serial, unsigned baud) {
  constexpr int caution = 3;
  return serial.gap_at(baud).value_or(caution * modbus::standard_silence(baud));
}

link::Units units_of(const catalogue::Profile& profile) {
  if (profile.link.any_unit) return link::Units::any;
  return profile.id.empty() ? link::Units::identified : link::Units::asked;
}

link::DemuxRules demux_rules(const catalogue::Profile& profile, modbus::Framing framing,
                             const link::Endpoint& endpoint) {
  link::DemuxRules rules{.framing = framing,
                         .units = units_of(profile),
                         .transactions = endpoint.transactions.value_or(profile.link.transactions)};
  if (catalogue::sends_unasked(profile)) rules.spontaneous = shapes_of(*profile.events);
  return rules;
}

/// 8000h or above. The nanoseconds of a clock are chance enough: they keep answers that a server
/// sent before, or makes up, from having the id of a request.
std::uint16_t transaction_at(TimePoint now) {
  constexpr std::uint16_t smallest = 0x8000;
  return smallest | static_cast<std::uint16_t>(now.time_since_epoch().count() & 0x7FFF);
}

link::SessionOptions session_options(const catalogue::Profile& profile,
                                     const link::Endpoint& endpoint, const LinkOptions& options,
                                     TimePoint now) {
  link::SessionOptions session;
  session.rules = demux_rules(profile, framing_of(endpoint, profile.link), endpoint);
  session.unit = endpoint.unit.value_or(modbus::UnitId{profile.link.unit});
  session.answer_timeout = options.answer_timeout.value_or(profile.link.answer);
  session.first_transaction = transaction_at(now);
  if (session.rules.framing == modbus::Framing::rtu) {
    const catalogue::SerialSpec& serial = profile.link.serial;
    const auto line = link::serial_settings(endpoint, serial.line);
    session.gap = endpoint.gap.value_or(gap_of(serial, line.baud));
    session.broadcast_gap = session.gap + serial.broadcast_pause;
    session.character_time = character_time(line);
    session.echo =
        endpoint.medium == link::Medium::simulated ? link::LocalEcho::absent : endpoint.echo;
    session.others = endpoint.medium == link::Medium::simulated
                         ? link::SessionOptions::Others::none
                         : link::SessionOptions::Others::possible;
    session.in_use_until = now;
    // Who else uses a device server is not to be seen, so its first answers are proved.
    const bool is_shared = endpoint.medium == link::Medium::rtu_over_tcp;
    session.late_answers =
        is_shared ? link::SessionOptions::LateAnswers::shared : options.late_answers;
  }
  if (session.rules.framing == modbus::Framing::tcp && !has_ids(session.rules)) {
    session.late_answers = options.late_answers;
    session.others = link::SessionOptions::Others::possible;  // what a gateway has behind it
  }
  if (profile.link.loopback) session.proof = link::SessionOptions::Proof::loopback;
  return session;
}

/// What is left of a connection that was ended from this side.
class ClosedTransport final : public link::Transport {
 public:
  Result<void> send(ByteView /*bytes*/, TimePoint /*deadline*/) override {
    return tl::unexpected(Error{.code = Errc::closed});
  }
  Result<std::size_t> receive(std::span<std::uint8_t> /*into*/, TimePoint /*deadline*/) override {
    return tl::unexpected(Error{.code = Errc::closed});
  }
  void set_uninterruptible() override {}
};

std::string target_of(const link::Endpoint& endpoint, const LinkOptions& options) {
  return options.shown.empty() ? endpoint.text : options.shown;
}

/// The address behind a tool's name; empty where the name is the address.
std::string endpoint_beside(const link::Endpoint& endpoint, const LinkOptions& options) {
  return options.shown.empty() || options.shown == endpoint.text ? std::string() : endpoint.text;
}

/// The text is the whole serial number; what function 17 says is compared with it.
void take_serial(std::string serial, catalogue::Identity& identity) {
  if (serial.empty() || serial == identity.serial) return;
  if (!identity.serial.empty()) {
    identity.notes.push_back(fmt::format(
        "serial number is {} in its registers, and {} by function 17", serial, identity.serial));
  }
  identity.serial = std::move(serial);
}

}  // namespace

modbus::Framing framing_of(const link::Endpoint& endpoint, const catalogue::LinkSpec& facts) {
  switch (endpoint.medium) {
    case link::Medium::tcp:
      return modbus::Framing::tcp;
    case link::Medium::serial:
    case link::Medium::rtu_over_tcp:
      return modbus::Framing::rtu;
    case link::Medium::simulated:
      break;
  }
  return facts.framing;
}

std::vector<link::SpontaneousShape> shapes_of(const catalogue::EventSpec& events) {
  const auto shape = [&](std::uint16_t count) {
    return link::SpontaneousShape{events.function, static_cast<std::uint8_t>(2 * count)};
  };
  std::vector<link::SpontaneousShape> shapes = {shape(events.count)};
  for (const catalogue::EventForm& form : events.longer) shapes.push_back(shape(form.count));
  for (const catalogue::EventFrame& frame : events.frames) {
    shapes.push_back({.function = frame.function});
  }
  return shapes;
}

link::SpontaneousShape shape_of(const catalogue::UnaskedFrame& frame) {
  return {frame.function, static_cast<std::uint8_t>(2 * frame.count)};
}

Device::Device(const link::Endpoint& endpoint, const catalogue::Profile& profile,
               const LinkOptions& options, std::unique_ptr<link::Session> session)
    : target_(target_of(endpoint, options)),
      endpoint_(endpoint_beside(endpoint, options)),
      at_(endpoint),
      profile_(&profile),
      session_(std::move(session)),
      retries_(options.retries.value_or(profile.link.retries)),
      limits_(read_limits(*profile_, options.unasked)),
      client_(*session_, limits_, retries_) {
  session_->hide(secrets_of(*profile_));
}

Device::~Device() {
  if (session_) session_->drain_late_answer();
}

Result<Device> Device::open(const link::Endpoint& endpoint, const catalogue::Profile& profile,
                            const LinkOptions& options, const OpenTransport& open_transport,
                            Clock& clock) {
  const Duration connect_timeout = options.connect_timeout.value_or(profile.link.connect);
  auto transport = open_transport(endpoint, profile.link, connect_timeout);
  if (!transport) {
    Error error = std::move(transport.error());
    error.target = target_of(endpoint, options);
    error.endpoint = endpoint_beside(endpoint, options);
    return tl::unexpected(std::move(error));
  }
  const bool reopens = options.reopening == link::Reopening::once &&
                       endpoint.medium == link::Medium::tcp && !(*transport)->is_shared();
  if (reopens) {
    const auto open = [=, facts = profile.link] {
      return open_transport(endpoint, facts, connect_timeout);
    };
    *transport = std::make_unique<link::ReopeningTransport>(std::move(*transport), open, clock,
                                                            options.trace);
  }
  auto session = std::make_unique<link::Session>(
      std::move(*transport), clock, session_options(profile, endpoint, options, clock.now()),
      options.trace);
  return Device(endpoint, profile, options, std::move(session));
}

Error Device::located(Error error) const {
  error = with_exception_text(std::move(error));
  const Asked asked{.endpoint = at_,
                    .profile = *profile_,
                    .unit = session_->options().unit,
                    .answered_before = session_->last_round_trip() > Duration::zero()};
  for (std::string hint : {hint_for_silence(error, asked), hint_for_absent_register(error)}) {
    if (!hint.empty()) error.hint = std::move(hint);
  }
  error.target = target_;
  error.endpoint = endpoint_;
  return error;
}

/// The maker's own words for an exception code are better than the standard's.
Error Device::with_exception_text(Error error) const {
  if (!error.exception) return error;
  if (const catalogue::CodeText* known = profile_->exceptions.find(*error.exception)) {
    error.message = fmt::format("the tool refused '{}' with exception {:02X} ({})", error.tried,
                                *error.exception, known->text);
    if (error.hint.empty()) error.hint = known->remedy;
  }
  return with_device_code(std::move(error));
}

/// Why it refused, as far as the tool says it in a register of its own.
Error Device::with_device_code(Error error) const {
  if (!error.device_code || !profile_->refusals) return error;
  const auto& codes = profile_->refusals->codes;
  const catalogue::CodeText* known = codes.find(*error.device_code);
  if (known == nullptr) {
    error.message += fmt::format("; its own code {:02X}h is not known", *error.device_code);
    return error;
  }
  error.message += fmt::format("; its own code {:02X}h: {}", *error.device_code, known->text);
  error.hint = known->remedy;
  return error;
}

Result<Bytes> Device::report_server_id() {
  return client_.report_server_id().map_error(
      [this](Error error) { return located(std::move(error)); });
}

void Device::disconnect() {
  session_ = std::make_unique<link::Session>(std::make_unique<ClosedTransport>(), session_->clock(),
                                             session_->options());
  client_ = link::Client(*session_, limits_, retries_);
}

void Device::set_retries(unsigned retries) {
  retries_ = retries;
  client_ = link::Client(*session_, limits_, retries_);
}

void Device::use(const catalogue::Profile& profile, catalogue::Identity identity) {
  profile_ = &profile;
  identity_text_ = text_of(identity);
  identity_ = std::move(identity);
  session_->set_rules(demux_rules(*profile_, session_->options().rules.framing, at_));
  session_->hide(secrets_of(*profile_));
  limits_ = read_limits(*profile_, {});
  client_ = link::Client(*session_, limits_, retries_);
  registers_known_ = true;
}

Result<void> Device::require_known_registers() {
  if (!profile_->identity || registers_known_) return {};
  auto answer = report_server_id();
  if (!answer && answer.error().code != Errc::exception_response) {
    return tl::unexpected(std::move(answer.error()));
  }
  const auto& facts = *profile_->identity;
  auto identity = catalogue::decode_identity(facts, answer.value_or(Bytes()));
  const catalogue::Judgement judgement = catalogue::judge(*profile_, identity);
  registers_known_ = judgement == catalogue::Judgement::fits;
  identity_text_ = text_of(identity);
  if (!registers_known_) return tl::unexpected(misfit(judgement, identity));
  identity_ = std::move(identity);
  return ask_more();
}

Error Device::misfit(catalogue::Judgement judgement, const catalogue::Identity& identity) const {
  const auto& facts = *profile_->identity;
  Error error{.code = Errc::wrong_generation, .target = target_, .endpoint = endpoint_};
  switch (judgement) {
    case catalogue::Judgement::other_product:
      error.code = Errc::mismatch;
      error.message = fmt::format("this is not what profile {} describes: {}", profile_->id,
                                  catalogue::misfit(*profile_, identity));
      error.hint = fmt::format("name its own profile: --profile {}", identity.product_profile);
      break;
    case catalogue::Judgement::later:
      error.message = fmt::format("firmware {} has other registers than profile {} (below {})",
                                  *identity.firmware, profile_->id, facts.firmware_below);
      break;
    case catalogue::Judgement::earlier:
      error.message = fmt::format("firmware {} has other registers than profile {} (from {})",
                                  *identity.firmware, profile_->id, facts.firmware_from);
      break;
    case catalogue::Judgement::unknown:
    case catalogue::Judgement::fits:
      error.message = fmt::format(
          "the tool does not identify itself as profile {} expects, so its registers "
          "are not known",
          profile_->id);
      break;
  }
  return error;
}

Result<void> Device::ask_more() {
  if (!identity_ || !profile_->identity || !profile_->identity->has_more()) return {};
  const auto& facts = *profile_->identity;
  std::vector<std::string> names = {facts.model_from, facts.serial_from};
  for (const catalogue::Text& name : facts.version_from) names.push_back(name);
  std::erase(names, "");
  TRY_LET(const auto parameters, profile_->select(names));
  TRY_LET(const auto readings, read_each(parameters, Limits::skip));
  const auto told = [&](std::string_view name) -> std::string {
    for (const Reading& reading : readings) {
      const bool is_meant = !name.empty() && reading.parameter.name == name;
      if (is_meant && reading.value) return reading.value->to_string();
    }
    return {};
  };
  if (auto model = told(facts.model_from); !model.empty()) identity_->tool_model = model;
  take_serial(told(facts.serial_from), *identity_);
  std::vector<std::string> numbers;
  for (const catalogue::Text& name : facts.version_from) numbers.push_back(told(name));
  const bool is_whole = std::find(numbers.begin(), numbers.end(), "") == numbers.end();
  if (is_whole) identity_->version = fmt::format("{}", fmt::join(numbers, "."));
  return {};
}

Result<std::vector<Reading>> Device::read_each(const std::vector<Parameter>& parameters,
                                               Limits limits, const link::Progress& progress) {
  for (const Parameter& parameter : parameters) {
    if (auto allowed = profile_->may_read(parameter); !allowed) {
      return tl::unexpected(about(std::move(allowed.error()), parameter.name, parameter.address));
    }
  }
  std::vector<RegisterRange> wanted;
  wanted.reserve(parameters.size());
  for (const Parameter& parameter : parameters) {
    wanted.push_back(range_of(parameter));
    for (const Parameter& decider : deciders_of(parameter)) wanted.push_back(range_of(decider));
  }
  std::vector<RegisterRange> wanted_limits;
  if (limits == Limits::read) wanted_limits = limit_ranges(parameters, nullptr);
  const std::size_t first_part = progress ? client_.count_wanted(wanted) : 0;
  const std::size_t second_part =
      progress && !wanted_limits.empty() ? client_.count_wanted(wanted_limits) : 0;
  auto values = client_.read_each(wanted, [&](std::size_t done, std::size_t total) {
    if (progress) progress(done, total + second_part);
  });
  if (!values) return tl::unexpected(located(std::move(values.error())));
  // What does not exist has no limits worth asking for.
  if (limits == Limits::read) wanted_limits = limit_ranges(parameters, &*values);
  auto limit_values = client_.read_each(wanted_limits, [&](std::size_t done, std::size_t total) {
    if (progress) progress(first_part + done, first_part + total);
  });
  if (!limit_values) return tl::unexpected(located(std::move(limit_values.error())));
  std::vector<Reading> readings;
  readings.reserve(parameters.size());
  for (const Parameter& parameter : parameters) {
    readings.push_back(reading_of(parameter, limits, *values, *limit_values));
  }
  return readings;
}

/// The registers of the tool's own limits; of those parameters that exist, as far as is known.
std::vector<RegisterRange> Device::limit_ranges(const std::vector<Parameter>& parameters,
                                                const link::RegisterImage* values) {
  std::vector<RegisterRange> ranges;
  for (const Parameter& parameter : parameters) {
    const auto own = profile_->limit_registers(parameter);
    if (!own || (values == nullptr && is_said_absent(parameter, *profile_))) continue;
    const RegisterRange minimum = range_at(parameter, own->minimum);
    const RegisterRange maximum = range_at(parameter, own->maximum);
    if (values != nullptr && !values->get(range_of(parameter))) {
      client_.avoid(minimum);
      client_.avoid(maximum);
      continue;
    }
    ranges.push_back(minimum);
    ranges.push_back(maximum);
  }
  return ranges;
}

/// The parameters that decide what the bits of another one are called, and what its steps are
/// worth.
std::vector<Parameter> Device::deciders_of(const Parameter& parameter) const {
  std::vector<Parameter> deciders;
  for (const catalogue::Text* name : {&parameter.bits_by, &parameter.scale_by}) {
    if (name->empty()) continue;
    if (auto decider = profile_->find(*name)) deciders.push_back(std::move(*decider));
  }
  return deciders;
}

/// The parameter as it is meant by what was read along.
Result<Parameter> Device::meant_by(const Parameter& parameter,
                                   const link::RegisterImage& image) const {
  return catalogue::meant_by_others(parameter, [&](std::string_view name) {
    return profile_->find(name).and_then([&](const Parameter& decider) {
      return image.get(range_of(decider)).and_then([&](const Registers& registers) {
        return decode(decider, registers);
      });
    });
  });
}

Reading Device::reading_of(const Parameter& parameter, Limits limits,
                           const link::RegisterImage& values,
                           const link::RegisterImage& limit_values) const {
  const auto with_name = [&](Error error) {
    error = located(std::move(error));
    error.name = parameter.name;
    return error;
  };
  const auto meant = meant_by(parameter, values);
  const auto value_at = [&](const RegisterRange& range,
                            const link::RegisterImage& image) -> Result<Value> {
    const auto registers = image.get(range);
    if (!registers) return tl::unexpected(with_name(registers.error()));
    if (!meant) return tl::unexpected(with_name(meant.error()));
    return decode(*meant, *registers).map_error(with_name);
  };
  Reading reading{.parameter = meant.value_or(parameter),
                  .registers = values.get(range_of(parameter)).map_error(with_name),
                  .value = value_at(range_of(parameter), values)};
  if (meant && reading.registers) {
    auto held = decode_or_raw(*meant, *reading.registers);
    if (held && held->content == catalogue::Content::raw) reading.raw = *std::move(held);
  }
  const auto own = limits == Limits::read ? profile_->limit_registers(parameter) : std::nullopt;
  if (!own || !reading.registers) return reading;
  auto minimum = value_at(range_at(parameter, own->minimum), limit_values);
  auto maximum = value_at(range_at(parameter, own->maximum), limit_values);
  if (minimum) reading.minimum = *minimum;
  if (maximum) reading.maximum = *maximum;
  if (!minimum) reading.limits_error = minimum.error();
  if (!maximum) reading.limits_error = maximum.error();
  return reading;
}

Result<Value> Device::read_value(const Parameter& parameter) {
  return client_.read(range_of(parameter))
      .and_then([&](const Registers& registers) { return decode_or_raw(parameter, registers); })
      .map_error([&](Error error) {
        error = located(std::move(error));
        error.name = parameter.name;
        return error;
      });
}

Error Device::about(Error error, const std::string& name, modbus::RegisterAddress address) const {
  error = located(std::move(error));
  error.name = name;
  error.register_address = address.value;
  return error;
}

Result<Registers> Device::read_block(const RegisterRange& range) {
  for (const Parameter& parameter : profile_->parameters) {
    if (parameter.reading != catalogue::Reading::consumes || parameter.table != range.table)
      continue;
    const RegisterRange alone = range_of(parameter);
    const std::uint32_t first = std::max(alone.first, range.first);
    if (first >= std::min<std::uint32_t>(alone.first + alone.count, range.first + range.count)) {
      continue;
    }
    Error error{.code = Errc::usage, .message = "reading it clears it"};
    error.register_address = static_cast<std::uint16_t>(first);
    return tl::unexpected(located(std::move(error)));
  }
  return read_raw(range);
}

Result<Registers> Device::read_raw(const RegisterRange& range) {
  return client_.read(range).map_error([this](Error error) { return located(std::move(error)); });
}

Result<void> Device::switch_events(EventOutput output) {
  const auto& arm = profile_->events->arm;
  if (!arm) return {};
  const std::uint16_t value = output == EventOutput::on ? arm->value : arm->disarm;
  return write_word(modbus::RegisterAddress{arm->address}, value);
}

Result<std::uint16_t> Device::event_number() {
  TRY_LET(const auto number, profile_->find(profile_->events->number));
  return read_raw(range_of(number)).map([](const Registers& registers) {
    return registers.front();
  });
}

Result<Registers> Device::event_block() {
  const catalogue::EventSpec& events = *profile_->events;
  const unsigned firmware = identity_ ? identity_->firmware.value_or(0) : 0;
  const std::uint16_t longest = events.count_for(firmware);
  if (longest > events.count && !has_usual_events_) {
    auto block = event_registers(longest);
    if (block || block.error().code != Errc::exception_response) return block;
    has_usual_events_ = true;
  }
  return event_registers(events.count);
}

Result<Registers> Device::event_registers(std::uint16_t count) {
  const catalogue::EventSpec& events = *profile_->events;
  const auto table = catalogue::table_of(events);
  // What is read in one piece of such a size looks like a frame that was sent unasked.
  const bool may_resemble = catalogue::sends_unasked(*profile_);
  Registers block;
  while (block.size() < count) {
    const auto left = static_cast<unsigned>(count - block.size());
    unsigned size = std::clamp<unsigned>(profile_->link.max_read, 1, left);
    while (size > 1 && may_resemble && events.has_form(size)) --size;
    const auto first = static_cast<std::uint16_t>(*events.first + block.size());
    auto part = read_raw({table, first, static_cast<std::uint16_t>(size)});
    if (!part) return part;
    block.insert(block.end(), part->begin(), part->end());
  }
  return block;
}

Result<std::optional<Registers>> Device::last_event() {
  TRY_LET(const auto number, profile_->find(profile_->events->number));
  const std::size_t number_at = number.address.value - *profile_->events->first;
  for (int attempt = 0; attempt < max_event_reads; ++attempt) {
    TRY_LET(auto block, event_block());
    TRY_LET(const auto again, event_number());
    if (again == block[number_at]) return block;
  }
  return std::nullopt;
}

Result<Shown> Device::take_event_flag() {
  if (!has_ids(session_->options().rules)) {
    return tl::unexpected(
        located({.code = Errc::usage,
                 .message = "a flag that reading clears can only be read where answers carry "
                            "transaction ids",
                 .hint = "connect the tool by Modbus TCP, without transaction=ignored"}));
  }
  for (const Parameter& parameter : profile_->parameters) {
    if (parameter.name != profile_->events->flag) continue;
    return client_.read_once_ever(range_of(parameter))
        .map_error([this](Error error) { return located(std::move(error)); })
        .map([](const Registers& registers) {
          const bool is_set = std::any_of(registers.begin(), registers.end(),
                                          [](std::uint16_t word) { return word != 0; });
          return is_set ? Shown::yes : Shown::no;
        });
  }
  return tl::unexpected(
      located({.code = Errc::usage, .message = "the profile says of no flag of events"}));
}

Result<Duration> Device::ping() {
  // FC 08 belongs to serial lines, so without a profile it is the best guess there.
  const bool serial = session_->options().rules.framing == modbus::Framing::rtu;
  const bool loopback = profile_->link.loopback || (serial && profile_->id.empty());
  auto response = session_->transact(loopback ? modbus::loopback_request(session_->fresh_word())
                                              : modbus::report_server_id_request());
  if (!response) return tl::unexpected(located(std::move(response.error())));
  return session_->last_round_trip();
}

Result<void> Device::require_answer() {
  auto answered = client_.loopback(session_->fresh_word());
  if (answered || answered.error().code == Errc::exception_response) return {};
  return tl::unexpected(located(std::move(answered.error())));
}

Result<Probe> Device::probe(modbus::UnitId unit) {
  session_->set_unit(unit);
  auto response = session_->transact(modbus::loopback_request(session_->fresh_word()));
  if (!response) return tl::unexpected(located(std::move(response.error())));
  const auto exception = modbus::exception_of(*response);
  return Probe{exception ? Answered::exception : Answered::data, session_->last_round_trip(),
               exception};
}

}  // namespace spindle::device

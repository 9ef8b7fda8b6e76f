#include "spindle/device/device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "device/hints.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/register_sets.hpp"
#include "spindle/device/command_word.hpp"

namespace spindle::device {
namespace {

/// How often a confirming parameter is read while its effect is awaited.
constexpr Duration confirm_interval = std::chrono::milliseconds(20);

/// How often the last event is read before giving up on one that stands still meanwhile.
constexpr int max_event_reads = 5;

/// How often the status is read while the tool works by itself.
constexpr Duration busy_interval = std::chrono::milliseconds(50);

using catalogue::Area;
using catalogue::Parameter;
using catalogue::Value;
using link::RegisterRange;
using modbus::FunctionCode;

RegisterRange range_of(const Parameter& parameter) {
  return {parameter.table, parameter.address.value, catalogue::register_count(parameter.encoding)};
}

RegisterRange range_at(const Parameter& parameter, modbus::RegisterAddress address) {
  return {parameter.table, address.value, catalogue::register_count(parameter.encoding)};
}

/// What an action writes, as a parameter that can be encoded.
Parameter as_parameter(const catalogue::Action& action) {
  Parameter parameter;
  parameter.name = action.name;
  parameter.table = action.table;
  parameter.address = action.address;
  parameter.encoding = action.encoding;
  return parameter;
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

/// The requests that write these registers or coils, as the profile wants them.
std::vector<modbus::Pdu> write_requests(modbus::RegisterTable table, modbus::RegisterAddress first,
                                        const Registers& registers,
                                        const catalogue::LinkSpec& link) {
  if (table == modbus::RegisterTable::coil) {
    return {registers.size() == 1 ? modbus::write_coil_request(first, registers.front())
                                  : modbus::write_coils_request(first, RegisterView(registers))};
  }
  constexpr auto several = static_cast<std::uint8_t>(FunctionCode::write_multiple_registers);
  const bool may_be_whole =
      link.write_function ? *link.write_function == several : registers.size() > 1;
  if (may_be_whole && registers.size() <= std::max<std::size_t>(link.max_write, 1)) {
    return {modbus::write_request(first, RegisterView(registers))};
  }
  std::vector<modbus::Pdu> requests;
  for (const std::uint16_t& word : registers) {
    requests.push_back(link.write_function == several
                           ? modbus::write_request(first, RegisterView(&word, 1))
                           : modbus::write_request(first, word));
    ++first.value;
  }
  return requests;
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
    limits.forbidden_shapes.push_back(read_of(shape_of(*profile.events)));
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
  if (catalogue::sends_unasked(profile)) rules.spontaneous.push_back(shape_of(*profile.events));
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

/// The first pause between two readings of a value that does not read right yet; it doubles.
constexpr Duration first_settling_pause = std::chrono::milliseconds(10);

/// The first pause before a write is sent again to a tool that answered "busy"; it doubles.
constexpr Duration first_busy_pause = std::chrono::milliseconds(50);

bool is_exception(const Error& error, modbus::ExceptionCode code) {
  return error.exception == static_cast<std::uint8_t>(code);
}

/// After a write: a missing or broken answer leaves open what the tool did, and so does a gateway
/// that waited for it in vain, and a connection that ended.
bool is_lost(const Error& error) {
  return link::is_lost_answer(error) || error.code == Errc::closed || error.code == Errc::reset ||
         is_exception(error, modbus::ExceptionCode::gateway_target_failed_to_respond);
}

/// Whether the tool can be asked what became of a write that failed so.
bool can_be_read_back(const Error& error) {
  return is_lost(error) || error.code == Errc::exception_response;
}

/// The tool says of a write or a reading that it will come to it later.
bool is_postponed(const Error& error) {
  return is_exception(error, modbus::ExceptionCode::acknowledge) ||
         is_exception(error, modbus::ExceptionCode::server_device_busy);
}

/// Whether the server has done nothing yet, and is to be asked again.
bool is_busy(const Error& error, const catalogue::LinkSpec& link) {
  if (link.busy.empty()) return is_exception(error, modbus::ExceptionCode::server_device_busy);
  return error.exception &&
         std::find(link.busy.begin(), link.busy.end(), *error.exception) != link.busy.end();
}

bool is_interruption(const Error& error) {
  return error.code == Errc::interrupted || error.code == Errc::terminated;
}

/// The tool acknowledged a deed, and only the proof is missing: a refused reading must not look
/// like a refused write.
Error without_proof(Error reading) {
  if (is_interruption(reading)) return reading;
  reading.message =
      fmt::format("the tool acknowledged it, but reading it back failed: {}", message_of(reading));
  if (reading.code == Errc::exception_response) reading.code = Errc::mismatch;
  return reading;
}

/// It is not known what became of a write without an answer that cannot be read back either.
Error without_knowledge(Error write, const Value& before, const Value& value) {
  if (is_interruption(write)) return write;
  write.hint = fmt::format("whether it was written is not known: it holds {} or {}; read it again",
                           before.to_string(), value.to_string());
  return write;
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

}  // namespace

bool is_refusal(const Error& error) {
  return error.code == Errc::exception_response && !is_postponed(error) &&
         !is_exception(error, modbus::ExceptionCode::gateway_path_unavailable) &&
         !is_exception(error, modbus::ExceptionCode::gateway_target_failed_to_respond);
}

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

link::SpontaneousShape shape_of(const catalogue::EventSpec& events) {
  return {events.function, static_cast<std::uint8_t>(2 * events.count)};
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
      client_(*session_, limits_, retries_) {}

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
  identity_ = std::move(identity);
  session_->set_rules(demux_rules(*profile_, session_->options().rules.framing, at_));
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
  identity_text_ =
      fmt::format("serial {}, firmware {}", identity.serial, identity.firmware.value_or(0));
  if (registers_known_) {
    identity_ = std::move(identity);
    return {};
  }
  Error error{.code = Errc::wrong_generation, .target = target_, .endpoint = endpoint_};
  if (judgement == catalogue::Judgement::other_product) {
    error.code = Errc::mismatch;
    error.message = fmt::format("this is not what profile {} describes: {}", profile_->id,
                                catalogue::misfit(*profile_, identity));
    error.hint = fmt::format("name its own profile: --profile {}", identity.product_profile);
    return tl::unexpected(std::move(error));
  }
  error.message =
      judgement == catalogue::Judgement::later
          ? fmt::format("firmware {} has other registers than profile {} (below {})",
                        *identity.firmware, profile_->id, facts.firmware_below)
          : fmt::format(
                "the tool does not identify itself as profile {} expects, so its registers "
                "are not known",
                profile_->id);
  return tl::unexpected(std::move(error));
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

/// The parameter as it is meant by what was read along: with the names of bits that count, and the
/// scale. Error where what its steps are worth could not be read.
Result<Parameter> Device::meant_by(const Parameter& parameter,
                                   const link::RegisterImage& image) const {
  Parameter meant = parameter;
  for (const Parameter& decider : deciders_of(parameter)) {
    const auto value = image.get(range_of(decider)).and_then([&](const Registers& registers) {
      return decode(decider, registers);
    });
    const bool scales = decider.name == parameter.scale_by.view();
    if (scales && !value) return tl::unexpected(value.error());
    if (scales) {
      const auto power = catalogue::power_of(*value);
      if (!power) {
        return tl::unexpected(Error{
            .code = Errc::bad_value,
            .message = fmt::format("{} is no power of ten: {}", decider.name, value->to_string())});
      }
      meant = catalogue::with_power(std::move(meant), *power);
      continue;
    }
    std::optional<std::int64_t> number;
    if (value && value->is_number()) number = value->number.mantissa();
    meant = catalogue::with_bits_for(std::move(meant), number);
  }
  return meant;
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
      .and_then([&](const Registers& registers) { return decode(parameter, registers); })
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

/// A product that takes one register a request gets the words of a pair one after the other, in the
/// order of their registers.
Result<void> Device::write_registers(modbus::RegisterTable table, modbus::RegisterAddress first,
                                     const Registers& registers) {
  for (const modbus::Pdu& request : write_requests(table, first, registers, profile_->link)) {
    if (auto written = client_.write(request); !written) return written;
  }
  return {};
}

/// A tool that refuses because it is busy has done nothing, so it is asked again for a while.
Result<void> Device::while_busy(const std::function<Result<void>()>& write) {
  const auto& refusals = profile_->refusals;
  const TimePoint limit = clock().now() + (refusals ? refusals->give_up_after : Duration::zero());
  while (true) {
    Result<void> written = write();
    const bool busy = !written && refusals && written.error().device_code &&
                      refusals->is_busy(*written.error().device_code);
    if (!busy) return written;
    const TimePoint next = clock().now() + refusals->retry_every;
    if (next > limit) return written;
    if (auto slept = clock().sleep_until(next); !slept) return slept;
  }
}

Result<void> Device::send_write(const Parameter& parameter, const Registers& registers) {
  const modbus::RegisterAddress first = parameter.written_at();
  return while_busy([&] { return write_registers(parameter.table, first, registers); })
      .map_error(
          [&](Error error) { return about(std::move(error), parameter.name, parameter.address); });
}

/// By the standard a busy tool (06) is to be asked again later, and has done nothing yet.
Result<void> Device::send_while_busy(const Parameter& parameter, const Value& value,
                                     Registers registers) {
  const catalogue::LinkSpec& link = profile_->link;
  const TimePoint limit =
      clock().now() + (link.busy.empty() ? session_->options().answer_timeout : link.busy_limit);
  Duration pause = link.busy.empty() ? first_busy_pause : link.busy_every;
  while (true) {
    auto sent = send_write(parameter, registers);
    const TimePoint next = clock().now() + pause;
    if (sent || !is_busy(sent.error(), link) || next > limit) return sent;
    if (auto slept = clock().sleep_until(next); !slept) return slept;
    if (link.busy.empty()) pause *= 2;
    if (!parameter.encoding.is_part()) continue;
    auto now = registers_for(parameter, value);  // what stands beside it may have changed
    if (!now) return tl::unexpected(std::move(now.error()));
    registers = std::move(*now);
  }
}

/// As soon as it reads as expected, or whatever it is when the time is over. A tool that answers
/// the reading with "busy" is asked again.
Result<Value> Device::settled(const Parameter& parameter, const Value& expected, Duration limit,
                              Proof proof) {
  const TimePoint deadline = clock().now() + limit;
  if (proof == Proof::after_settling) {
    if (auto slept = clock().sleep_until(deadline); !slept) return tl::unexpected(slept.error());
  }
  Duration pause = first_settling_pause;
  while (true) {
    auto now = read_value(parameter);
    const bool final = now ? *now == expected : !is_postponed(now.error());
    const TimePoint at = clock().now();
    if (final || at >= deadline) return now;
    if (auto slept = clock().sleep_until(std::min(at + pause, deadline)); !slept) {
      return tl::unexpected(slept.error());
    }
    pause *= 2;
  }
}

/// The tool says that it did nothing. Half of a pair may have been written all the same, and a tool
/// that failed at it (04) may have failed in the middle.
Written Device::refused(Error error, const Parameter& parameter, const Value& before,
                        const Value& value) {
  const bool pair = catalogue::register_count(parameter.encoding) > 1;
  const bool failed =
      is_exception(error, modbus::ExceptionCode::server_device_failure) && !error.device_code;
  if (!pair && !failed) return {WriteResult::refused, before, std::move(error)};
  const auto now = read_value(parameter);
  if (!now) {
    error.message += "; what it holds now could not be read";
    return {WriteResult::unknown, std::nullopt, std::move(error), Doubt::may_act_late};
  }
  if (*now == before) return {WriteResult::refused, *now, std::move(error)};
  if (*now == value) return {WriteResult::written, *now};
  error.message += fmt::format("; it was written in part and holds {}", now->to_string());
  return {WriteResult::coerced, *now, std::move(error)};
}

Written Device::judged(const Parameter& parameter, const Value& before, const Value& value,
                       const Result<void>& sent, const Result<Value>& now) const {
  if (!now) {
    const bool by_reading = sent || is_interruption(now.error());
    return {
        WriteResult::unknown, std::nullopt,
        by_reading ? without_proof(now.error()) : without_knowledge(sent.error(), before, value),
        Doubt::may_act_late};
  }
  if (*now == value) return {WriteResult::written, *now};
  const bool same = *now == before;
  const std::string holds = fmt::format("{} holds {}", same ? "still" : "now", now->to_string());
  Error error;
  if (sent) {
    error =
        about({.code = Errc::mismatch,
               .message = fmt::format("the tool acknowledged {} but {}", value.to_string(), holds),
               .hint = "is the tool running, locked, or set to refuse changes?"},
              parameter.name, parameter.address);
  } else {
    error = sent.error();
    error.message = fmt::format("{}; it {}", message_of(error), holds);
  }
  const bool rejected =
      !sent && (is_exception(error, modbus::ExceptionCode::server_device_busy) ||
                is_exception(error, modbus::ExceptionCode::gateway_path_unavailable));
  const WriteResult kept = rejected ? WriteResult::refused : WriteResult::mismatch;
  return {same ? kept : WriteResult::coerced, *now, std::move(error), Doubt::may_act_late};
}

/// The registers of a value; those of which only some bits are its own are read first.
Result<Registers> Device::registers_for(const Parameter& parameter, const Value& value) {
  if (auto fits = catalogue::check_pair(parameter.encoding, profile_->link); !fits) {
    return tl::unexpected(std::move(fits.error()));
  }
  if (!parameter.encoding.is_part()) return catalogue::encode(parameter, value);
  const auto present = client_.read(range_of(parameter));
  if (!present) return present;
  return catalogue::encode(parameter, value, *present);
}

Written Device::write(const Parameter& parameter, const Value& before, const Value& value,
                      Proof proof) {
  const auto locked = unlock_for(parameter);
  if (!locked) {
    return {WriteResult::refused, before, about(locked.error(), parameter.name, parameter.address)};
  }
  Written written = write_unlocked(parameter, before, value, proof);
  if (!*locked) return written;
  const auto put_back = lock_again(**locked);
  if (put_back) return written;
  if (written.error) {
    written.error->message = not_put_back(message_of(*written.error), put_back.error());
    return written;
  }
  Error error = about(put_back.error(), parameter.name, parameter.address);
  error.message = not_put_back("it was written", put_back.error());
  return {WriteResult::unknown, written.now, std::move(error)};
}

Written Device::write_unlocked(const Parameter& parameter, const Value& before, const Value& value,
                               Proof proof) {
  auto registers = registers_for(parameter, value);
  if (!registers) {
    return {WriteResult::refused, before,
            about(std::move(registers.error()), parameter.name, parameter.address)};
  }
  const Duration settling = parameter.settle.value_or(profile_->link.settle);
  auto sent = send_while_busy(parameter, value, *registers);
  if (!sent && is_refusal(sent.error())) {
    return refused(std::move(sent.error()), parameter, before, value);
  }
  if (!sent && !can_be_read_back(sent.error())) {
    return judged(parameter, before, value, sent, tl::unexpected(sent.error()));
  }
  const bool works_on_it = !sent && is_exception(sent.error(), modbus::ExceptionCode::acknowledge);
  auto now = settled(
      parameter, value,
      works_on_it ? std::max(settling, session_->options().answer_timeout) : settling, proof);
  const bool did_not_take =
      !sent && is_lost(sent.error()) && now && *now == before && !(*now == value);
  if (did_not_take) {
    if (parameter.encoding.is_part()) registers = registers_for(parameter, value);
    if (!registers) return judged(parameter, before, value, sent, now);
    sent = send_while_busy(parameter, value, *registers);
    if (sent || can_be_read_back(sent.error())) now = settled(parameter, value, settling, proof);
  }
  return judged(parameter, before, value, sent, now);
}

/// Writes what others have to wait for. Returns what it held; empty: nothing was written.
Result<std::optional<Device::Lock>> Device::unlock_for(const Parameter& parameter) {
  const auto& unlock = profile_->unlock;
  if (!unlock || parameter.name == unlock->parameter.view()) return std::nullopt;
  const auto& needed = unlock->needed_by;
  const bool is_needed =
      needed.empty() || std::any_of(needed.begin(), needed.end(), [&](const auto& pattern) {
        return glob_match(pattern, parameter.name);
      });
  if (!is_needed) return std::nullopt;
  auto lock = profile_->find(unlock->parameter);
  if (!lock) return tl::unexpected(std::move(lock.error()));
  const auto before = read_value(*lock);
  if (!before) return tl::unexpected(before.error());
  const Value key{Decimal(unlock->value)};
  if (*before == key) return std::nullopt;
  const Written written = write_unlocked(*lock, *before, key, Proof::first_right);
  if (written.done()) return Lock{std::move(*lock), *before};
  Error error = *written.error;
  const bool is_open = written.may_have_changed();
  if (const auto put_back = is_open ? lock_again({*lock, *before}) : Result<void>(); !put_back) {
    error.message = not_put_back(message_of(error), put_back.error());
  }
  return tl::unexpected(std::move(error));
}

Result<void> Device::lock_again(const Lock& lock) {
  const Value key{Decimal(profile_->unlock->value)};
  Written written = write_unlocked(lock.parameter, key, lock.before, Proof::first_right);
  const bool was_stopped = written.error && (written.error->code == Errc::interrupted ||
                                             written.error->code == Errc::terminated);
  if (was_stopped) {  // the command ends, but not with a tool that is open
    session_->set_uninterruptible();
    written = write_unlocked(lock.parameter, key, lock.before, Proof::first_right);
  }
  if (written.done()) return {};
  return tl::unexpected(*written.error);
}

std::string Device::not_put_back(std::string_view what, const Error& why) const {
  return fmt::format("{}, but {} could not be put back: {}", what, profile_->unlock->parameter,
                     message_of(why));
}

void Device::shield(Clock& calm) {
  session_->set_uninterruptible();
  calm_ = &calm;
}

Result<void> Device::send(const catalogue::Action& action, std::int64_t value) {
  const auto registers = catalogue::encode(as_parameter(action), {Decimal(value)});
  if (!registers) return tl::unexpected(registers.error());
  if (auto fits = catalogue::check_pair(action.encoding, profile_->link); !fits) return fits;
  return while_busy([&] { return write_registers(action.table, action.address, *registers); })
      .map_error([&](Error error) { return about(std::move(error), action.name, action.address); });
}

Result<void> Device::send(const Parameter& parameter, const Decimal& number) {
  const auto registers = registers_for(parameter, {number});
  if (!registers) return tl::unexpected(registers.error());
  const auto first = parameter.written_at();
  return write_registers(parameter.table, first, *registers).map_error([&](Error error) {
    return about(std::move(error), parameter.name, parameter.address);
  });
}

Result<void> Device::write_word(modbus::RegisterAddress address, std::uint16_t word) {
  return write_registers(modbus::RegisterTable::holding, address, {word})
      .map_error([this](Error error) { return located(std::move(error)); });
}

Result<Shown> Device::shows(const std::string& parameter, std::int64_t number) {
  const auto found = profile_->find(parameter);
  if (!found) return tl::unexpected(found.error());
  return read_value(*found).map(
      [&](const Value& value) { return value.number == Decimal(number) ? Shown::yes : Shown::no; });
}

Result<ActionResult> Device::perform(const catalogue::Action& action, std::int64_t value) {
  if (action.confirm.empty()) return carry_out(action, value);
  const auto confirming = profile_->find(action.confirm);
  if (!confirming) return tl::unexpected(confirming.error());
  const Value expected{Decimal(action.confirm_value.value_or(value))};
  if (action.prepare) {
    const auto now = read_value(*confirming);
    if (!now) return tl::unexpected(now.error());
    if (*now == expected) return ActionResult::confirmed;
  }
  auto done = carry_out(action, value);
  if (!done && can_be_read_back(done.error()) && !is_refusal(done.error())) {
    return found_done(action, *confirming, expected, std::move(done.error()));
  }
  if (!done || *done == ActionResult::not_confirmed) return done;
  return confirm(action, *confirming, expected);
}

/// The answer does not say what became of it, and it is never sent again: its effect does.
Result<ActionResult> Device::found_done(const catalogue::Action& action,
                                        const Parameter& confirming, const Value& expected,
                                        Error error) {
  const auto found = confirm(action, confirming, expected);
  if (found == ActionResult::confirmed) return found;
  if (!found && is_interruption(found.error())) return found;
  error.hint = found ? fmt::format("{} does not show the effect", confirming.name)
                     : fmt::format("whether it was done is not known: {} could not be read",
                                   confirming.name);
  return tl::unexpected(std::move(error));
}

/// What there is to do: nothing is known of the effect but that the tool is ready again.
Result<ActionResult> Device::carry_out(const catalogue::Action& action, std::int64_t value) {
  if (action.prepare) {
    if (auto prepared = prepare(*action.prepare); !prepared) {
      return tl::unexpected(about(std::move(prepared.error()), action.name, action.address));
    }
  }
  auto sent = action.rest ? send(action, *action.rest) : Result<void>();
  if (sent) sent = send(action, value);
  if (!sent) return tl::unexpected(std::move(sent.error()));
  auto ready = await_ready(action.busy);
  if (ready && action.rest) {
    sent = send(action, *action.rest);
    if (!sent) return tl::unexpected(std::move(sent.error()));
    ready = await_ready(action.busy);
  }
  if (!ready) return tl::unexpected(without_proof(std::move(ready.error())));
  if (*ready == Shown::no) return ActionResult::not_confirmed;
  return action.busy > Duration::zero() ? ActionResult::finished : ActionResult::sent;
}

Result<ActionResult> Device::confirm(const catalogue::Action& action, const Parameter& confirming,
                                     const Value& expected) {
  const TimePoint deadline = clock().now() + session_->options().answer_timeout;
  while (true) {
    auto now = read_value(confirming);
    if (!now) {
      now.error().name = action.name;
      return tl::unexpected(without_proof(std::move(now.error())));
    }
    if (*now == expected) return ActionResult::confirmed;
    const TimePoint next = clock().now() + confirm_interval;
    if (next > deadline) return ActionResult::not_confirmed;
    if (auto slept = clock().sleep_until(next); !slept) return tl::unexpected(slept.error());
  }
}

/// On a driver whose inputs are assigned otherwise other bits do the same; all of them where that
/// cannot be known.
std::uint16_t Device::bits_to_clear(const catalogue::Preparation& preparation) {
  const auto motor = CommandWord::of(*profile_);
  const bool varies =
      motor && motor->has_inputs() && motor->command_register() == preparation.address;
  if (!varies) return preparation.clear;
  const auto bits = motor->read_bits(*this, std::numeric_limits<std::uint16_t>::max());
  return bits ? bits->any_of(preparation.clear) : std::numeric_limits<std::uint16_t>::max();
}

Result<void> Device::prepare(const catalogue::Preparation& preparation) {
  const auto words = read_raw({modbus::RegisterTable::holding, preparation.address.value, 1});
  if (!words) return tl::unexpected(words.error());
  const std::uint16_t word = words->front();
  const auto cleared = static_cast<std::uint16_t>(word & ~unsigned{bits_to_clear(preparation)});
  if (cleared == word) return {};
  return while_busy([&] {
    return write_registers(modbus::RegisterTable::holding, preparation.address, {cleared});
  });
}

/// Until the status says that the tool does no longer work by itself; no limit: it never does.
Result<Shown> Device::await_ready(Duration limit) {
  if (limit == Duration::zero()) return Shown::yes;
  const auto model = RunModel::of(*profile_);
  const MotorMonitor* monitor = model ? (*model)->monitor() : nullptr;
  if (monitor == nullptr) return Shown::yes;
  const auto status = profile_->find(monitor->facts().status);
  if (!status) return tl::unexpected(status.error());
  const TimePoint deadline = clock().now() + limit;
  while (true) {
    const auto word = read_value(*status);
    if (!word) return tl::unexpected(word.error());
    if (!monitor->is_busy(word->number)) return Shown::yes;
    const TimePoint next = clock().now() + busy_interval;
    if (next > deadline) return Shown::no;
    if (auto slept = clock().sleep_until(next); !slept) return tl::unexpected(slept.error());
  }
}

// ---- everybody ----

Result<void> Device::broadcast_word(modbus::RegisterAddress address, std::uint16_t word) {
  return broadcast_registers(modbus::RegisterTable::holding, address, {word});
}

Result<void> Device::broadcast_registers(modbus::RegisterTable table, modbus::RegisterAddress first,
                                         const Registers& registers) {
  for (const modbus::Pdu& request : write_requests(table, first, registers, profile_->link)) {
    auto sent = session_->broadcast(request);
    if (!sent) return tl::unexpected(located(std::move(sent.error())));
  }
  return {};
}

Result<void> Device::broadcast(const Parameter& parameter, const Value& value) {
  const auto registers = catalogue::encode(parameter, value);
  if (!registers) return tl::unexpected(registers.error());
  if (auto fits = catalogue::check_pair(parameter.encoding, profile_->link); !fits) return fits;
  const auto first = parameter.written_at();
  return broadcast_registers(parameter.table, first, *registers).map_error([&](Error error) {
    return about(std::move(error), parameter.name, parameter.address);
  });
}

/// No register says when it is done, so the longest time that it may take is waited for.
Result<void> Device::broadcast(const catalogue::Action& action, std::int64_t value) {
  Result<void> sent;
  if (action.prepare) sent = broadcast_word(action.prepare->address, 0);
  if (sent && action.rest) sent = broadcast_word(action.address, *action.rest);
  if (sent) sent = broadcast(as_parameter(action), Value{Decimal(value)});
  if (!sent || !action.rest) return sent;
  if (action.busy > Duration::zero()) {
    sent = clock().sleep_until(clock().now() + action.busy);
  }
  return sent ? broadcast_word(action.address, *action.rest) : sent;
}

Result<Registers> Device::read_block(const RegisterRange& range) {
  for (const std::uint16_t address : catalogue::consumed_registers(*profile_, range.table)) {
    if (address < range.first || address - range.first >= range.count) continue;
    Error error{.code = Errc::usage, .message = "reading it clears it"};
    error.register_address = address;
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
  const auto number = profile_->find(profile_->events->number);
  if (!number) return tl::unexpected(number.error());
  return read_raw(range_of(*number)).map([](const Registers& registers) {
    return registers.front();
  });
}

Result<Registers> Device::event_block() {
  const catalogue::EventSpec& events = *profile_->events;
  const auto table = catalogue::table_of(events);
  // What is read in one piece looks like a frame that was sent unasked.
  const unsigned unlike = catalogue::sends_unasked(*profile_) ? events.count - 1U : events.count;
  const unsigned most = std::clamp<unsigned>(profile_->link.max_read, 1, std::max(unlike, 1U));
  Registers block;
  while (block.size() < events.count) {
    const auto left = static_cast<unsigned>(events.count - block.size());
    const auto first = static_cast<std::uint16_t>(events.first + block.size());
    auto part = read_raw({table, first, static_cast<std::uint16_t>(std::min(left, most))});
    if (!part) return part;
    block.insert(block.end(), part->begin(), part->end());
  }
  return block;
}

Result<std::optional<Registers>> Device::last_event() {
  const auto number = profile_->find(profile_->events->number);
  if (!number) return tl::unexpected(number.error());
  const std::size_t number_at = number->address.value - profile_->events->first;
  for (int attempt = 0; attempt < max_event_reads; ++attempt) {
    auto block = event_block();
    if (!block) return tl::unexpected(std::move(block.error()));
    const auto again = event_number();
    if (!again) return tl::unexpected(again.error());
    if (*again == (*block)[number_at]) return std::move(*block);
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

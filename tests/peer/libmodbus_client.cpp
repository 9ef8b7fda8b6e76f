// libmodbus as a client of the simulated DOGA BM: libmodbus_client PORT. Every line that it prints
// is something that is not as it should be; status 1 then.
#include <modbus.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

namespace {

using Context = std::unique_ptr<modbus_t, decltype(&modbus_free)>;
using Words = std::vector<std::uint16_t>;

/// What went wrong so far.
class Report {
 public:
  void expect(bool holds, const char* what) {
    if (holds) return;
    failed_ = true;
    std::printf("%s (last error: %s)\n", what, modbus_strerror(errno));
  }
  [[nodiscard]] int status() const { return failed_ ? 1 : 0; }

 private:
  bool failed_ = false;
};

using Read = int (*)(modbus_t*, int, int, std::uint16_t*);

/// Empty when the read failed.
Words read(modbus_t* context, Read how, int first, int count) {
  Words words(static_cast<std::size_t>(count));
  return how(context, first, count, words.data()) == count ? words : Words();
}

bool is_refused(int outcome, int exception) { return outcome == -1 && errno == exception; }

void check_reads(modbus_t* tool, Report& report) {
  report.expect(read(tool, modbus_read_registers, 2, 2) == Words{271, 1000},
                "holding 2 and 3 are not those of the manual's example");
  report.expect(read(tool, modbus_read_registers, 1002, 1).size() == 1,
                "no minimum of parameter 2");
  report.expect(read(tool, modbus_read_registers, 2002, 1) == Words{600},
                "the maximum of parameter 2 is not 600");
  report.expect(read(tool, modbus_read_registers, 1, 100).size() == 100,
                "100 registers cannot be read at once");
  report.expect(read(tool, modbus_read_input_registers, 3200, 14).size() == 14,
                "the last event cannot be read");
  const Words status = read(tool, modbus_read_input_registers, 3300, 14);
  report.expect(status.size() == 14 && status[7] == 0 && status[8] == 0,
                "the live status does not show a tool at rest");
}

void check_writes(modbus_t* tool, Report& report) {
  report.expect(modbus_write_register(tool, 2, 310) == 1, "holding 2 cannot be written");
  report.expect(read(tool, modbus_read_registers, 2, 1) == Words{310},
                "holding 2 does not hold what was written");
  report.expect(modbus_write_register(tool, 4002, 0) == 1, "auto output cannot be switched off");
}

void check_identity(modbus_t* tool, Report& report) {
  constexpr std::array<std::uint8_t, 12> expected = {0x00, 0x01, 0x00, 0x01, 0x00, 0x03,
                                                     0x08, 0x37, 0x3C, 0xDC, 0xC0, 0x0A};
  std::array<std::uint8_t, MODBUS_MAX_PDU_LENGTH> identity = {};
  const int size = modbus_report_slave_id(tool, static_cast<int>(identity.size()), identity.data());
  report.expect(size == static_cast<int>(expected.size()) &&
                    std::equal(expected.begin(), expected.end(), identity.begin()),
                "FC 17 does not give the identity of the profile");
}

void check_exceptions(modbus_t* tool, Report& report) {
  std::array<std::uint16_t, 2> words = {};
  report.expect(is_refused(modbus_read_registers(tool, 564, 2, words.data()), EMBXILADD),
                "a hole of the parameters is not refused with exception 02");
  report.expect(is_refused(modbus_read_input_registers(tool, 3099, 1, words.data()), EMBXILADD),
                "an input register that does not exist is not refused with exception 02");
  // 0E, as the tool says "outside the limits"; libmodbus knows codes below 12 only.
  report.expect(is_refused(modbus_write_register(tool, 2, 601), EMBBADEXC),
                "a value above the maximum is not refused");
  report.expect(is_refused(modbus_write_registers(tool, 2, 2, words.data()), EMBXILFUN),
                "FC 16 is not refused with exception 01");
  std::uint8_t bit = 0;
  report.expect(is_refused(modbus_read_bits(tool, 0, 1, &bit), EMBXILFUN),
                "FC 01 is not refused with exception 01");
  report.expect(read(tool, modbus_read_registers, 2, 1) == Words{310},
                "a refused write has changed holding 2, or an exception has upset the stream");
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fputs("usage: libmodbus_client PORT\n", stderr);
    return 2;
  }
  const Context tool(modbus_new_tcp("127.0.0.1", std::atoi(arguments[1])), modbus_free);
  if (!tool || modbus_connect(tool.get()) != 0) {
    std::fprintf(stderr, "no connection: %s\n", modbus_strerror(errno));
    return 1;
  }
  modbus_set_response_timeout(tool.get(), 10, 0);
  Report report;
  check_reads(tool.get(), report);
  check_writes(tool.get(), report);
  check_identity(tool.get(), report);
  check_exceptions(tool.get(), report);
  modbus_close(tool.get());
  return report.status();
}

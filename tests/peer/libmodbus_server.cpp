// A Modbus TCP server on libmodbus: libmodbus_server doga|stock. Prints its port, serves one client
// after another until it is stopped. libmodbus answers everything but FC 17 of 'doga': there it can
// only send its own identity, so that answer is written to the socket by hand.
#include <arpa/inet.h>
#include <modbus.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>

namespace {

constexpr int presets = 15;
constexpr int fields = 15;
constexpr int registers_end = 4006;
constexpr std::uint8_t report_server_id = 0x11;
constexpr std::size_t mbap_size = 7;

using Context = std::unique_ptr<modbus_t, decltype(&modbus_free)>;
using Mapping = std::unique_ptr<modbus_mapping_t, decltype(&modbus_mapping_free)>;

/// id 1, controller 1, model 3 (3204), firmware 2103, serial 1021100042 (60427 §3.4), behind their
/// byte count.
constexpr std::array<std::uint8_t, 13> doga_identity = {0x0C, 0x00, 0x01, 0x00, 0x01, 0x00, 0x03,
                                                        0x08, 0x37, 0x3C, 0xDC, 0xC0, 0x0A};

/// Field k of preset n holds 100 n + k and may go from 0 to 2000; the mode holds 0 and may go to 1.
void fill(modbus_mapping_t& mapping) {
  for (int address = 1; address <= presets * fields; ++address) {
    const int preset = (address - 1) / fields + 1;
    const int field = (address - 1) % fields + 1;
    const bool is_mode = field == 1;
    mapping.tab_registers[address] = static_cast<std::uint16_t>(is_mode ? 0 : 100 * preset + field);
    mapping.tab_registers[1000 + address] = 0;
    mapping.tab_registers[2000 + address] = is_mode ? 1 : 2000;
  }
  mapping.tab_input_registers[3200] = 1962;
  mapping.tab_input_registers[3204] = 0xFFF6;
}

/// The request's header with the identity behind it.
bool send_identity(int socket, const std::uint8_t* request) {
  std::array<std::uint8_t, mbap_size + 1 + doga_identity.size()> answer = {};
  std::memcpy(answer.data(), request, mbap_size);
  answer[4] = 0;
  answer[5] = static_cast<std::uint8_t>(1 + 1 + doga_identity.size());
  answer[mbap_size] = report_server_id;
  std::memcpy(answer.data() + mbap_size + 1, doga_identity.data(), doga_identity.size());
  return send(socket, answer.data(), answer.size(), MSG_NOSIGNAL) ==
         static_cast<ssize_t>(answer.size());
}

/// Until the client leaves.
void serve(modbus_t* context, modbus_mapping_t* mapping, bool as_doga) {
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request = {};
  for (;;) {
    const int size = modbus_receive(context, request.data());
    if (size < 0) return;
    if (as_doga && request[mbap_size] == report_server_id) {
      if (!send_identity(modbus_get_socket(context), request.data())) return;
    } else if (modbus_reply(context, request.data(), size, mapping) < 0) {
      return;
    }
  }
}

/// Port that the system chose; 0 when it cannot be told.
int port_of(int socket) {
  sockaddr_in address = {};
  socklen_t size = sizeof address;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

}  // namespace

int main(int count, char** arguments) {
  const std::string_view identity = count == 2 ? arguments[1] : "";
  if (identity != "doga" && identity != "stock") {
    std::fputs("usage: libmodbus_server doga|stock\n", stderr);
    return 2;
  }
  const Context context(modbus_new_tcp("127.0.0.1", 0), modbus_free);
  const Mapping mapping(modbus_mapping_new(0, 0, registers_end, registers_end),
                        modbus_mapping_free);
  if (!context || !mapping) return 1;
  fill(*mapping);

  int listener = modbus_tcp_listen(context.get(), 1);
  if (listener < 0) return 1;
  std::printf("%d\n", port_of(listener));
  std::fflush(stdout);
  while (modbus_tcp_accept(context.get(), &listener) >= 0) {
    serve(context.get(), mapping.get(), identity == "doga");
    modbus_close(context.get());
  }
  return 1;
}

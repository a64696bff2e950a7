# SPDX-License-Identifier: BSD-3-Clause
"""RdtSensor against a stand-in, a process of its own: tests/drivers/rdt_server.py."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from settings_process import SettingsProcess

import dual_proxy as dp
from dual_proxy.ft_sensor import fetch_rdt_params, rdt_params_from_xml

SERVER = Path(__file__).parent / "rdt_server.py"
PAGE = b"""<netft><cfgcpf>1000</cfgcpf><cfgcpt>2e6</cfgcpt><scfgfu>lbf</scfgfu>
<scfgtu>lbf-in</scfgtu></netft>"""


# Reads what the sensor's clock says, and compares it with the reading's time,
# until it may end; prints the largest difference.
COMPARE = """
import sys, threading
import dual_proxy as dp

start = float(sys.argv[2])
with dp.RdtSensor(dp.RdtSensorParams(host="127.0.0.1", port=int(sys.argv[1]),
                                     reports="arm_on_tool", silence=5)) as sensor:
    end = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), end.set())).start()
    print("open", flush=True)
    worst = 0
    while not end.wait(1e-4):
        reading = sensor.read()
        worst = max(worst, abs(reading.time - start - reading.value[0]))
    print(worst)
"""


class Server(SettingsProcess):
    """The stand-in's process."""

    def __init__(self):
        super().__init__(SERVER)

    def params(self, **fields):
        return dp.RdtSensorParams(host="127.0.0.1", port=self.ports["rdt"], **fields)


@pytest.fixture
def server():
    server = Server()
    yield server
    server.close()


def wait_for(condition, timeout=5.0):
    """Return the time it takes; a busy machine may take long."""
    start = time.monotonic()
    while not condition():
        assert time.monotonic() < start + timeout
        time.sleep(0.001)
    return time.monotonic() - start


def take(sensor, records):
    """Wait for so many more records."""
    start = sensor.counts.taken
    wait_for(lambda: sensor.counts.taken >= start + records)


def test_reads_what_the_sensor_measures(server):
    server.set(counts=[1_000_000, -2_000_000, 3_000_000, 40_000, -50_000, 60_000])
    params = fetch_rdt_params(
        "127.0.0.1", http_port=server.ports["http"], port=server.ports["rdt"]
    )
    assert params == server.params()
    before = time.monotonic()
    with dp.RdtSensor(params) as sensor:
        take(sensor, 1)
        reading = sensor.read()
        now = time.monotonic()
        assert reading.valid
        assert before < reading.time < now
        assert reading.age(now) == now - reading.time
        expected = [-1, 2, -3, -0.04, 0.05, -0.06]
        np.testing.assert_allclose(reading.value, expected, atol=0.004)
        assert sensor.fault == ""
        assert isinstance(sensor, dp.ForceTorqueSensorDriver)
    assert not sensor.read().valid
    wait_for(lambda: server.set()["stops"] == 1)
    # Nothing but streams was asked for: no bias is set in the sensor.
    assert server.set()["others"] == 0


def test_mounted_turned(server):
    server.set(counts=[5_000_000, 0, 0, 0, 700_000, 0])
    turned = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    params = server.params(R_SN=turned, reports="arm_on_tool")
    with dp.RdtSensor(params) as sensor:
        expected = [0, 5, 0, -0.7, 0, 0]
        np.testing.assert_allclose(sensor.read().value, expected, atol=0.004)


def test_losses_and_disorder_are_counted_and_nothing_else_happens(server):
    server.set(loss=0.1, repeat=0.1, reorder=0.1, garbage=0.1)
    with dp.RdtSensor(server.params(silence=5)) as sensor:
        times = []
        start = time.monotonic()
        while sensor.counts.taken < 500:
            assert time.monotonic() < start + 10
            reading = sensor.read()
            assert reading.valid
            assert np.abs(reading.value).max() < 0.01
            times.append(reading.time)
            time.sleep(0.0005)
        assert np.all(np.diff(times) >= 0)
        counts = sensor.counts
    assert counts.lost > 20
    assert counts.repeated > 20
    assert counts.late > 20
    assert counts.malformed > 20
    assert counts.lost < 0.4 * (counts.taken + counts.lost)
    assert (counts.restarts, counts.faulty, counts.requests) == (0, 0, 1)


def test_silence(server):
    with dp.RdtSensor(server.params()) as sensor:
        server.set(silent=True)
        last = sensor.read()
        took = wait_for(lambda: not sensor.read().valid)
        silent = sensor.read()
        assert silent.time >= last.time
        assert silent.age(time.monotonic()) >= 0.1
        assert "no record for 0.1 s" in sensor.fault
        wait_for(lambda: server.set()["streams"] >= 3)
        server.set(silent=False)
        again = wait_for(lambda: sensor.read().valid)
        assert sensor.fault == ""
    print(f"not valid after {1e3 * took:.0f} ms, valid again after {1e3 * again:.0f}")


def test_reboot(server):
    with dp.RdtSensor(server.params()) as sensor:
        take(sensor, 20)
        server.set(reboot=True)
        wait_for(lambda: sensor.counts.requests >= 2)
        take(sensor, 20)
        wait_for(lambda: sensor.read().valid)
        # The new stream's small numbers are not taken for late ones.
        assert sensor.counts.late == 0


def test_a_sensor_that_hangs_grows_old_and_then_is_not_valid(server):
    with dp.RdtSensor(server.params(silence=5)) as sensor:
        server.set(hung=True)
        take(sensor, 20)  # Some may have been on their way.
        last = sensor.read()
        take(sensor, 5)
        assert sensor.read().time == last.time
        took = wait_for(lambda: not sensor.read().valid)
        assert sensor.read().time == last.time
        assert "the same values for 0.05 s" in sensor.fault
        server.set(hung=False)
        wait_for(lambda: sensor.read().valid)
        assert sensor.fault == ""
    print(f"not valid after {1e3 * took:.0f} ms")


def test_values_that_stand_still_are_not_valid(server):
    with dp.RdtSensor(server.params(silence=5)) as sensor:
        server.set(frozen=True)
        took = wait_for(lambda: not sensor.read().valid)
        assert "the same values for 0.05 s" in sensor.fault
        server.set(frozen=False)
        wait_for(lambda: sensor.read().valid)
    print(f"not valid after {1e3 * took:.0f} ms")


def test_fault_of_the_sensor(server):
    with dp.RdtSensor(server.params(silence=5)) as sensor:
        server.set(status=0x80000004, counts=[9_000_000] * 6)
        wait_for(lambda: not sensor.read().valid)
        assert np.abs(sensor.read().value).max() < 0.01
        assert sensor.fault.endswith("it reports status 0x80000004: broken gage")
        server.set(status=0)
        wait_for(lambda: sensor.read().valid)
        server.set(counts=[600_000_000, 0, 0, 0, 0, 0])
        wait_for(lambda: not sensor.read().valid)
        assert "beyond max_force (500 N)" in sensor.fault


def test_a_sensor_that_is_not_well_is_not_opened(server):
    server.set(status=0x80000001)
    sensor = dp.RdtSensor(server.params())
    with pytest.raises(dp.DriverError, match="temperature out of range"):
        sensor.open()
    assert not sensor.read().valid


def test_what_waited_for_a_stopped_process_is_as_old_as_it_is(server):
    start = time.monotonic()
    server.set(clock=start)
    process = subprocess.Popen(
        [sys.executable, "-c", COMPARE, str(server.ports["rdt"]), str(start)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "open\n"
    process.send_signal(signal.SIGSTOP)
    time.sleep(1.0)
    process.send_signal(signal.SIGCONT)
    time.sleep(0.2)
    worst = float(process.communicate(timeout=10)[0])
    # Of the oldest that waited it is 0.7 s and more if they count as new.
    assert worst < 0.3
    print(f"{1e3 * worst:.1f} ms")


def test_goes_when_the_sensor_dies(server):
    sensor = dp.RdtSensor(server.params())
    sensor.open()
    server.process.kill()
    wait_for(lambda: not sensor.read().valid)
    wait_for(lambda: "Connection refused" in sensor.fault)
    start = time.monotonic()
    sensor.close()
    print(f"closed in {1e3 * (time.monotonic() - start):.0f} ms")
    sensor.close()
    assert "not open" in sensor.fault


def test_page_gives_scales_and_units():
    params = rdt_params_from_xml(PAGE, host="10.0.0.7")
    assert (params.counts_per_force, params.counts_per_torque) == (1000, 2e6)
    assert (params.force_unit, params.torque_unit) == ("lbf", "lbf-in")
    assert params.host == "10.0.0.7"
    by_code = PAGE.replace(b"scfgfu", b"cfgfu").replace(b">lbf<", b">5<")
    assert rdt_params_from_xml(by_code).force_unit == "kgf"
    for name, unit in {b"N-m": "Nm", b"Nmm": "Nmm", b"kN-m": "kNm"}.items():
        page = PAGE.replace(b"lbf-in", name)
        assert rdt_params_from_xml(page).torque_unit == unit


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"<cfgcpf>1000</cfgcpf>", b"", "field `cfgcpf` is missing"),
        (b">1000<", b">0<", "`cfgcpf` expected a number > 0, got '0'"),
        (b">1000<", b">inf<", "`cfgcpf` expected a number > 0, got 'inf'"),
        (b">2e6<", b">many<", "`cfgcpt` expected a number > 0, got 'many'"),
        (b">lbf<", b">stone<", "`scfgfu` expected one of lbf, N, .*, got 'stone'"),
        (b"scfgtu>", b"cfgtu>", "`cfgtu` expected one of lbf-in, .*, got 'lbf-in'"),
        (b"<netft>", b"<netft><comrdte>Disabled</comrdte>", "`comrdte`.*RDT is off"),
        (b"</netft>", b"", "expected XML"),
        (b"<netft>", b'<!DOCTYPE x [<!ENTITY a "b">]><netft>', "without declarations"),
        (b"<netft>", b"\xff\xfe<\0", "without declarations"),
    ],
)
def test_bad_page_is_refused_by_name(old, new, message):
    assert old in PAGE
    with pytest.raises(dp.DriverError, match=message):
        rdt_params_from_xml(PAGE.replace(old, new))


def test_page_that_is_not_there_or_too_long(server):
    http = server.ports["http"]
    server.set(xml="<netft>" + " " * 300_000 + "</netft>")
    with pytest.raises(dp.DriverError, match=r"netftapi2.xml: expected at most 262144"):
        fetch_rdt_params("127.0.0.1", http_port=http)
    with pytest.raises(dp.DriverError, match=r"^http://127.0.0.1:\d+/netftapi2.xml: "):
        fetch_rdt_params("127.0.0.1", http_port=server.ports["rdt"])
    with pytest.raises(dp.DriverError):
        fetch_rdt_params("no host", http_port=http)

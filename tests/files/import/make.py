#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes the files of this folder from the truth of write.py, in the forms of other programs. Their .expected are written by
PRISM_REWRITE=1 ../importing.py 0 and reviewed. usage: make.py"""
import datetime
import math
import os
import struct
import sys
import zlib

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))
from write import EPOCH, RATE, TEMP, TIME

ROWS = 12
STAMPS = [EPOCH + datetime.timedelta(seconds=t) for t in TIME[:ROWS]]
DATA = list(zip(STAMPS, RATE, TEMP))
SENT = [bytes((i * 37 + 0xA5) % 256 for i in range(begin, begin + 16)) for begin in range(0, 48, 16)]


def put(name, lines, end="\n"):
    with open(os.path.join(HERE, name), "wb") as file:
        file.write(lines if isinstance(lines, bytes) else "".join(line + end for line in lines).encode())


def ms(stamp):
    return stamp.microsecond // 1000


def comma(value):
    return f"{value:.5f}".replace(".", ",")


def loggers():
    """Two loggers joined by time; Graphtec, Yokogawa and HOBO."""
    joined = [(t, f"{r:.5f}", "") for t, r in zip(TIME[:ROWS], RATE)] + [(t + 0.25, "", f"{c:.5f}") for t, c in list(zip(TIME[:ROWS], TEMP))[::3]]
    put("outer-joined.csv", ["time_s,rate [deg/h],T [degC]", *(",".join(map(str, row)) for row in sorted(joined))])
    put("graphtec.csv", ['Vendor,"GRAPHTEC Corporation"', 'Model,"GL840"', 'Version,"Ver1.20"', "Sampling interval,500ms", "Total data points,12",
                         "Start time,2024-03-25,12:00:00", "AMP settings", "CH,Signal name,Input,Range,Filter,Span,,Unit",
                         'CH1,"rate",DC,10V,Off,"+10.00","-10.00",V', 'CH2,"T",TEMP,TC_K,Off,"+100.0","+0.0",degC', "Data",
                         "Number,Date&Time,ms,CH1,CH2,Alarm1-10,AlarmOut", "NO.,Time,ms,V,degC,A1234567890,A1234",
                         *(f"{i},{d:%Y/%m/%d %H:%M:%S},{ms(d):>4},+ {r:.5f},+ {c:.3f},LLLLLLLLLL,LLLL" for i, (d, r, c) in enumerate(DATA, 1))], "\r\n")
    put("yokogawa-scope.csv", ['"Header Size",16', '"Model Name","DL850E"', '"BlockNumber",1', '"TraceName","rate","T"', '"BlockSize",12,12', '"VUnit","V","C"',
                               '"SampleRate",2.0E+00,2.0E+00', '"HResolution",5.0E-01,5.0E-01', '"HOffset",0.0E+00,0.0E+00', '"HUnit","s","s"',
                               '"Date","2024/03/25","2024/03/25"', '"Time","12:00:00.50","12:00:00.50"', "", *(f",{r:.5E},{c:.5E}" for _, r, c in DATA)], "\r\n")
    put("yokogawa-recorder.csv", ['"YOKOGAWA","GX20"', '"Ch","","","0001","0002"', '"Tag","","","rate","T"', '"Unit","","","V","C"', '"Date","Time","ms","",""',
                                  *(f"{d:%Y/%m/%d},{d:%H:%M:%S},{ms(d):03d},{r:.5f},{c:.5f}" for d, r, c in DATA)], "\r\n")
    put("hobo.csv", ['"Plot Title: chamber"', '"#","Date Time, GMT+00:00","Temp, °C (LGR S/N: 1)","Host Connected (LGR S/N: 1)"',
                     *(f"{i},{EPOCH + datetime.timedelta(seconds=i):%m/%d/%Y %I:%M:%S %p},{c:.3f}," for i, c in enumerate(TEMP[:ROWS], 1))])


def programs():
    """InfluxDB as it exports two fields, and pivoted; ROS; LabVIEW; dates with years of two digits; Excel."""
    header = ["#group,false,false,true,true,false,false,true,true", "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string", "#default,_result,,,,,,,"]
    stamped = [(f",,{{}},2024-03-25T00:00:00Z,2024-03-26T00:00:00Z,{d:%Y-%m-%dT%H:%M:%S}.{ms(d):03d}Z", r, c) for d, r, c in DATA]
    put("influxdb.csv", [*header, ",result,table,_start,_stop,_time,_value,_field,_measurement", *(f"{s.format(0)},{r},rate,gyro" for s, r, _ in stamped),
                         *(f"{s.format(1)},{c},temperature,gyro" for s, _, c in stamped)], "\r\n")
    put("influxdb-pivot.csv", [*header, ",result,table,_start,_stop,_time,rate,temperature,_measurement", *(f"{s.format(0)},{r},{c},gyro" for s, r, c in stamped)], "\r\n")
    put("ros.csv", ["%time,field.angular_velocity.z,field.temperature",
                    *(f"{1711368000 * 10**9 + int(t * 10**9)},{math.radians(r) / 3600:.10g},{c}" for t, r, c in zip(TIME[:ROWS], RATE, TEMP))])
    put("labview.lvm", ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t,", "***End_of_Header***\t", "\t", "Channels\t2\t\t", "Samples\t12\t12\t",
                        "Y_Unit_Label\tdeg/h\tC\t", "X_Dimension\tTime\tTime\t", "X0\t0,0E+0\t0,0E+0\t", "Delta_X\t0,5\t0,5\t", "***End_of_Header***\t\t\t", "X_Value\trate\tT\tComment",
                        *(f"{comma(t)}\t{comma(r)}\t{comma(c)}" + "\tfirst" * (t == 0.5) for t, r, c in zip(TIME[:ROWS], RATE, TEMP))], "\r\n")
    put("two-digit-years.csv", ["Date;Time;rate [deg/h];T [degC]", *(f"{d:%d.%m.%y};{d:%H:%M:%S},{ms(d):03d};{comma(r)};{comma(c)}" for d, r, c in DATA)])
    import openpyxl
    book = openpyxl.Workbook()
    book.active.title = "Messung"
    for row in (["Prüfling 70-0042"], ["Zeit", "Drehrate [°/h]", "Temperatur (°C)", "U"], *([d, comma(r), comma(c), 5.25] for d, r, c in DATA)):
        book.active.append(row)
    book.create_sheet("Notizen").append(["one row"])
    book.save(os.path.join(HERE, "excel-decimal-commas.xlsx"))


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(name, class_, shape, body):
    return element(14, element(6, struct.pack("<II", class_, 0)) + element(5, struct.pack("<ii", *shape)) + element(1, name.encode()) + body)


def doubles(name, rows):
    """A matrix of doubles, by rows."""
    values = [row[c] for c in range(len(rows[0])) for row in rows]
    return matrix(name, 6, (len(rows), len(rows[0])), element(9, struct.pack(f"<{len(values)}d", *values)))


def structure(name, fields):
    return matrix(name, 2, (1, 1), element(5, struct.pack("<i", 8)) + element(1, b"".join(key.encode().ljust(8, b"\0") for key, _ in fields)) + b"".join(value for _, value in fields))


def matlab():
    """As NaveGo saves its sensors: structs with vectors, matrices of 3 columns and texts, with another time each; a chamber as rows."""
    imu = structure("imu", [("t", doubles("", [[t] for t in TIME[:ROWS]])), ("fb", doubles("", [[0.0, 0.0, -9.8]] * ROWS)),
                            ("wb", doubles("", [[0.0, r, 0.0] for r in RATE[:ROWS]])), ("freq", doubles("", [[2.0]])),
                            ("name", matrix("", 4, (1, 3), element(4, "gyr".encode("utf-16-le"))))])
    gnss = structure("gnss", [("t", doubles("", [[t] for t in TIME[:4]])), ("lat", doubles("", [[34.0]] * 4))])
    header = b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\0\1IM"
    put("navego.mat", header + b"".join(struct.pack("<II", 15, len(packed)) + packed for packed in map(zlib.compress, (imu, gnss))))
    rows = [TIME[:ROWS], RATE[:ROWS], TEMP[:ROWS]]
    put("rows.mat", header + doubles("data", rows) + doubles("time_s", [TIME[:ROWS]]))
    put("cut.mat", (header + doubles("data", rows) + doubles("time_s", [TIME[:ROWS]]))[:-40])
    bomb = matrix("time_s", 6, (1, 150_000_000), struct.pack("<II", 2, 150_000_000))  # states 143 MiB of zeros
    packer = zlib.compressobj(9)
    packed = packer.compress(struct.pack("<II", 14, len(bomb) - 8 + 150_000_000) + bomb[8:])
    packed += b"".join(packer.compress(bytes(1_000_000)) for _ in range(150)) + packer.flush()
    put("inflating.mat", header + struct.pack("<II", 15, len(packed)) + packed)


def dumps():
    put("xxd.txt", [f"{i * 16:08x}: {line.hex(' ', 2)}  {'.' * 16}" for i, line in enumerate(SENT)])
    zeros = bytes(8).hex(" ")
    put("hexdump.txt", [f"00000000  {SENT[0][:8].hex(' ')}  {SENT[0][8:].hex(' ')}  |.Z..............|", f"00000010  {zeros}  {zeros}  |................|", "*",
                        f"00000030  {SENT[1].hex(' ')}  |................|", "00000040"])
    put("terminal.log", ["=~=~=~= PuTTY log 2024.03.25 12:00:00 =~=~=~=", *(f"[2024-03-25 12:00:0{i}.{part}" for i, line in enumerate(SENT)
                                                                        for part in ("123] [TX] 3F 0D", f"223] [RX] {line.hex(' ').upper()}"))])
    put("socat.txt", [f"< 2024/03/01 12:00:05.{i:06}  length=16 from={i * 16} to={i * 16 + 15}\n {line.hex(' ')}" for i, line in enumerate(SENT)])
    put("plain-hex.txt", [", ".join(f"0x{byte:02X}" for byte in line) for line in SENT])
    bodies = [f"$GYRO,{r:.5f},{c:.3f}" for r, c in zip(RATE[:4], TEMP)]
    sentences = []
    for body in bodies:
        check = 0
        for byte in body[1:].encode():
            check ^= byte
        sentences.append(f"{body}*{check:02X}")
    put("sentences.log", [f"[12:00:0{i}.5] {text}" for i, text in enumerate([*sentences[:2], sentences[2].replace("8.4", "8.5"), sentences[3]])])


if __name__ == "__main__":
    loggers()
    programs()
    matlab()
    dumps()

// Tests of csharp/Htvm.cs.
//     Program.exe interface                 how structs, constants and functions are declared, for check_interface.py
//     Program.exe digests STREAM            a line for each frame, as in tests/data/conformance
//     Program.exe tests STREAM              everything else, on a stream of one group
//     Program.exe encode FOLDER FILE        writes meshes, OBJ, into the folder, and the stream of the encoder's defaults
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using Htvm;

static class Program
{
    static int Main(string[] arguments)
    {
        switch (arguments[0])
        {
            case "interface": PrintInterface(); return 0;
            case "digests": PrintDigests(arguments[1]); return 0;
            case "seeks": SeeksShowWhatPlayingShows(File.ReadAllBytes(arguments[1])); return 0;
            case "encode": EncodeAtDefaults(arguments[1], arguments[2]); return 0;
            default: RunTests(File.ReadAllBytes(arguments[1])); return 0;
        }
    }

    // ---- what the declarations say ------------------------------------------------------------------------------------

    static void PrintInterface()
    {
        var structs = typeof(Native).Assembly.GetTypes().Where(t => t.IsValueType && t.IsLayoutSequential && !t.IsEnum &&
                                                                    t.IsPublic | t.IsNestedPublic && t.Namespace == "Htvm");
        foreach (var type in structs)
        {
            Console.WriteLine("struct {0} {1}", type.Name, Marshal.SizeOf(type));
            foreach (var field in type.GetFields())
                Console.WriteLine("field {0} {1} {2} {3}", type.Name, field.Name, Marshal.OffsetOf(type, field.Name),
                                  Abi(field.FieldType));
        }
        foreach (var type in new[] { typeof(Status), typeof(FrameKind), typeof(FrameReason), typeof(Attributes), typeof(Up), typeof(Profile) })
            foreach (var value in Enum.GetValues(type))
                Console.WriteLine("constant {0} {1} {2}", type.Name, value, Convert.ToInt64(value));
        foreach (var method in typeof(Native).GetMethods().Where(m => m.Name.StartsWith("htvm_")))
            Console.WriteLine("function {0} {1} {2}", method.Name, Abi(method.ReturnType),
                              string.Join(" ", method.GetParameters().Select(p => Abi(p.ParameterType))));
    }

    // How a type is passed.
    static string Abi(Type type)
    {
        if (type == typeof(void)) return "void";
        if (type.IsEnum) type = Enum.GetUnderlyingType(type);
        if (type.IsByRef || type.IsArray || type == typeof(IntPtr)) return "pointer";
        if (type == typeof(UIntPtr)) return "size_t";
        if (type == typeof(int)) return "int32_t";
        if (type == typeof(uint)) return "uint32_t";
        if (type == typeof(long)) return "int64_t";
        if (type == typeof(ulong)) return "uint64_t";
        if (type == typeof(double)) return "double";
        return "struct";
    }

    // ---- decoding -----------------------------------------------------------------------------------------------------

    static uint[] crcTable;

    static uint Crc(uint crc, byte[] bytes, int count)
    {
        if (crcTable == null)
        {
            crcTable = new uint[256];
            for (uint n = 0; n < 256; ++n)
            {
                uint value = n;
                for (int bit = 0; bit < 8; ++bit) value = (value & 1) != 0 ? value >> 1 ^ 0xEDB88320 : value >> 1;
                crcTable[n] = value;
            }
        }
        for (int i = 0; i < count; ++i) crc = crcTable[(crc ^ bytes[i]) & 255] ^ crc >> 8;
        return crc;
    }

    static uint Add(uint crc, Array array, int bytes)
    {
        var copy = new byte[bytes];
        Buffer.BlockCopy(array, 0, copy, 0, bytes);
        return Crc(crc, copy, bytes);
    }

    static uint Digest(FrameReader reader) { return Digest(reader.Frame); }

    static uint Digest(Frame frame)
    {
        uint crc = 0xFFFFFFFF;
        crc = Add(crc, frame.Positions, 12 * frame.VertexCount);
        crc = Add(crc, frame.Indices, 4 * frame.IndexCount);
        if (frame.Has(Attributes.Colours)) crc = Add(crc, frame.Colours, 3 * frame.VertexCount);
        if (frame.Has(Attributes.Normals)) crc = Add(crc, frame.Normals, 12 * frame.VertexCount);
        if (frame.Has(Attributes.Texcoords)) crc = Add(crc, frame.Texcoords, 8 * frame.VertexCount);
        return ~crc;
    }

    static void PrintDigests(string path)
    {
        const string kinds = "IEPTT"; // a patched frame is a T-frame here
        using (var frame = new FrameReader(File.OpenRead(path)))
            while (frame.Next())
                Console.WriteLine("{0} {1} {2} {3} {4:x8}", frame.Info.Frame, kinds[(int)frame.Info.Type], frame.VertexCount,
                                  frame.IndexCount / 3, Digest(frame));
    }

    // Back and forth by steps that differ, from one decoder.
    static void SeeksShowWhatPlayingShows(byte[] stream)
    {
        var expected = Digests(stream);
        var random = new Random(1);
        using (var film = new FrameFile(stream))
        {
            Require(film.FrameCount == expected.Count && film.DamagedBytes == 0, "all frames are found");
            for (int n = 0; n < 3 * expected.Count; ++n)
            {
                int frame = n < expected.Count ? expected.Count - 1 - n : random.Next(expected.Count);
                film.Show(frame);
                Require(Digest(film.Frame) == expected[frame], "frame " + frame + " after a seek");
                Require(film.FrameAt(film.TimeOf(frame)) >= frame, "it is found by its time");
            }
        }
    }

    // ---- the rest -----------------------------------------------------------------------------------------------------

    static void Require(bool fact, string what)
    {
        if (!fact) throw new Exception("not so: " + what);
    }

    static HtvmException Fails(Action action, Status status, string words)
    {
        try
        {
            action();
        }
        catch (HtvmException exception)
        {
            Require(exception.Status == status, status + ", not " + exception.Status + ": " + exception.Message);
            Require(exception.Message.Contains(words), "'" + exception.Message + "' says '" + words + "'");
            return exception;
        }
        throw new Exception("no exception that says " + words);
    }

    static void RunTests(byte[] stream)
    {
        DamageIsAnExceptionBehindWhichReadingGoesOn(stream);
        ALimitIsAnException(stream);
        ADecoderThatWasDisposedOfSaysSo();
        LentArraysAreTheCopiedOnes(stream);
        WhatIsEncodedDecodes();
        WrongOptionsAreExceptions();
        SeekingGoesOnBehindDamage(stream);
        Console.WriteLine("{0} passed, 0 failed", 7);
    }

    static void DamageIsAnExceptionBehindWhichReadingGoesOn(byte[] stream)
    {
        var whole = Digests(stream).Count;
        var cut = stream.Take(stream.Length - 7).ToArray();
        using (var frames = new FrameReader(new MemoryStream(cut)))
        {
            int count = 0;
            Fails(() => { while (frames.Next()) ++count; }, Status.CorruptStream, "cut short");
            Require(count >= whole - 1 && count > 0, "all frames before the cut");
            Require(!frames.Next(), "and then it is the end");
        }
        using (var frames = new FrameReader(new MemoryStream(new byte[5000])))
            Fails(() => frames.Next(), Status.CorruptStream, "5000 bytes");
    }

    static List<uint> Digests(byte[] stream)
    {
        var digests = new List<uint>();
        using (var frames = new FrameReader(new MemoryStream(stream)))
            while (frames.Next()) digests.Add(Digest(frames));
        return digests;
    }

    static void SeekingGoesOnBehindDamage(byte[] stream)
    {
        Fails(() => new FrameFile(new byte[5000]), Status.CorruptStream, "5000 bytes");
        var expected = Digests(stream);
        var damaged = (byte[])stream.Clone();
        damaged[damaged.Length / 2] ^= 1;
        using (var film = new FrameFile(damaged))
        {
            Require(film.FrameCount == expected.Count - 1 && film.DamagedBytes > 0, "one frame is lost");
            int whole = 0;
            for (int frame = 0; frame < film.FrameCount; ++frame)
                try
                {
                    film.Show(frame);
                    if (expected.Contains(Digest(film.Frame))) ++whole;
                }
                catch (HtvmException exception)
                {
                    Require(exception.Status == Status.CorruptStream, exception.Message);
                }
            Require(whole > 1, "the frames before the damage, and others");
        }
    }

    static void ALimitIsAnException(byte[] stream)
    {
        var options = Decoder.Options();
        Require(options.MaxVertices == 1 << 22 && options.Threads == 0, "the defaults of htvm.h");
        options.MaxVertices = 10;
        using (var frames = new FrameReader(new MemoryStream(stream), options))
            Fails(() => frames.Next(), Status.Limit, "vertices");
    }

    static void ADecoderThatWasDisposedOfSaysSo()
    {
        var decoder = new Decoder();
        FrameInfo info;
        Fails(() => decoder.View(), Status.BadInput, "no current frame");
        decoder.Dispose();
        decoder.Dispose();
        Fails(() => decoder.ReceiveFrame(out info), Status.BadInput, "disposed");
    }

    static void LentArraysAreTheCopiedOnes(byte[] stream)
    {
        using (var frames = new FrameReader(new MemoryStream(stream)))
            while (frames.Next())
            {
                var view = frames.Decoder.View();
                Require(view.Vertices == frames.VertexCount && view.Topology == frames.Info.Topology, "the same frame");
                var positions = new float[3 * view.Vertices];
                Marshal.Copy(view.Positions, positions, 0, positions.Length);
                Require(positions.SequenceEqual(frames.Positions.Take(positions.Length)), "the same positions");
                // Memory that is no array, as a NativeArray's.
                var memory = Marshal.AllocHGlobal(12 * (int)view.Vertices);
                frames.Decoder.CopyPositions(memory, positions.Length);
                var copied = new float[positions.Length];
                Marshal.Copy(memory, copied, 0, copied.Length);
                Marshal.FreeHGlobal(memory);
                Require(copied.SequenceEqual(positions), "the same positions in memory that is no array");
                Fails(() => frames.Decoder.CopyPositions(new float[1]), Status.BufferTooSmall, "room");
            }
    }

    // A sheet that bends.
    const int side = 12;

    static int[] SheetIndices()
    {
        var indices = new List<int>();
        for (int y = 0; y + 1 < side; ++y)
            for (int x = 0; x + 1 < side; ++x)
            {
                int v = y * side + x;
                indices.AddRange(new[] { v, v + 1, v + side, v + 1, v + side + 1, v + side });
            }
        return indices.ToArray();
    }

    static float[] SheetPositions(int frame)
    {
        var positions = new float[3 * side * side];
        for (int v = 0; v < side * side; ++v)
        {
            int x = v % side - side / 2;
            positions[3 * v] = 10 * (v % side);
            positions[3 * v + 1] = 10 * (v / side);
            positions[3 * v + 2] = 0.1f * frame * x * x;
        }
        return positions;
    }

    // The meshes and the file that becomes of them.
    static void EncodeAtDefaults(string folder, string path)
    {
        var culture = System.Globalization.CultureInfo.InvariantCulture;
        var indices = SheetIndices();
        var packets = new List<byte[]>();
        using (var encoder = new Encoder())
        {
            for (int frame = 0; frame < 4; ++frame)
            {
                var positions = SheetPositions(frame);
                using (var obj = new StreamWriter(Path.Combine(folder, frame + ".obj")))
                {
                    for (int v = 0; v < positions.Length; v += 3)
                        obj.WriteLine(string.Format(culture, "v {0:R} {1:R} {2:R}", positions[v], positions[v + 1], positions[v + 2]));
                    for (int i = 0; i < indices.Length; i += 3)
                        obj.WriteLine("f {0} {1} {2}", indices[i] + 1, indices[i + 1] + 1, indices[i + 2] + 1);
                }
                packets.AddRange(encoder.Push(positions, indices, null, (long)Math.Round(frame * 1e6 / 30)));
            }
            packets.AddRange(encoder.Finish());
            packets.RemoveAt(packets.Count - 1);
            packets.Insert(0, encoder.FrontIndex());
        }
        File.WriteAllBytes(path, packets.SelectMany(packet => packet).ToArray());
    }

    // With a skeleton of one bone.
    static void WhatIsEncodedDecodes()
    {
        var indices = SheetIndices();
        var skeleton = new Skeleton { JointNames = new[] { "pelvis", "neck ü" }, BoneJoints = new ushort[] { 0, 1 } };
        var options = new Dictionary<string, string> { { "subject_size", "1000" }, { "up", "y" }, { "tracked.simplify", "0" } };
        var bytes = new MemoryStream();
        Action<List<byte[]>> store = packets => packets.ForEach(packet => bytes.Write(packet, 0, packet.Length));
        using (var encoder = new Encoder(quality: 60, skeleton: skeleton, options: options, floor: -5,
                                         metadata: new Dictionary<string, string> { { "title", "a sheet" } }))
        {
            for (int frame = 0; frame < 4; ++frame)
            {
                var positions = SheetPositions(frame);
                var colours = Enumerable.Range(0, 3 * side * side).Select(n => (byte)n).ToArray();
                var pose = new Pose { Joints = new double[] { 50, 10, 0, 50, 100, 0 } };
                store(encoder.Push(positions, indices, colours, 40000 * frame, pose, forceIntra: frame == 2));
                if (frame > 0) continue;
                Fails(() => encoder.Push(new float[10], new int[0], null, 1), Status.BadInput, "positions must have 9");
                Fails(() => encoder.Push(positions, new[] { 0, 1, 99999 }, null, 1), Status.BadInput, "99999");
                Fails(() => encoder.Push(positions, indices, null, 1, new Pose { Joints = new double[3] }),
                      Status.BadInput, "joints must have 6");
            }
            Fails(() => encoder.SetBitrate(1e6), Status.BadInput, "rate.bits_per_second");
            FrameInfo last;
            Require(encoder.LastFrame(out last) && last.Frame == 3 && last.Type == FrameKind.Tracked, "the last frame");
            Fails(() => encoder.FrontIndex(), Status.BadInput, "finished");
            var ending = encoder.Finish();
            store(ending);
            // In a file: the index in front, in place of the last packet.
            var index = encoder.FrontIndex();
            var length = (int)bytes.Length - ending[ending.Count - 1].Length;
            var indexed = index.Concat(bytes.ToArray().Take(length)).ToArray();
            Require(Digests(indexed).SequenceEqual(Digests(bytes.ToArray())), "the same frames behind the index");
        }
        var kinds = new List<FrameKind>();
        bytes.Position = 0;
        using (var frames = new FrameReader(bytes))
        {
            while (frames.Next())
            {
                kinds.Add(frames.Info.Type);
                Require(frames.Info.TimestampUs == 40000 * (kinds.Count - 1), "the timestamp");
                Require(frames.TopologyChanged == (frames.Info.Type == FrameKind.Intra), "a new topology with each I-frame");
                Require(frames.Info.Reason == (kinds.Count == 3 ? FrameReason.Due : FrameReason.None), "why it was sent");
                var joints = new double[6];
                frames.Decoder.CopyJoints(joints);
                Require(Math.Abs(joints[4] - 100) < 5 && Math.Abs(joints[1] - 10) < 5, "the joints");
                var orientations = new double[9];
                frames.Decoder.CopyOrientations(orientations);
                Require(Math.Abs(orientations.Sum(r => r * r) - 3) < 1e-6, "the orientations");
            }
            SequenceInfo sequence;
            Require(frames.Decoder.Sequence(out sequence) && sequence.Up == Up.Y && sequence.Floor == -5, "up and floor");
            Require(frames.Decoder.Metadata()["title"] == "a sheet", "the title");
            Require(frames.Decoder.JointName(1) == "neck ü", "the joints' names");
            uint first, second;
            double radius;
            frames.Decoder.Bone(0, out first, out second, out radius);
            Require(first == 0 && second == 1 && radius > 0, "the bone");
        }
        var expected = new[] { FrameKind.Intra, FrameKind.Tracked, FrameKind.Intra, FrameKind.Tracked };
        Require(kinds.SequenceEqual(expected), "an I-frame where it was asked for");
    }

    static void WrongOptionsAreExceptions()
    {
        Func<string, string, Action> with = (name, value) =>
            () => new Encoder(options: new Dictionary<string, string> { { name, value } }).Dispose();
        Fails(with("key_intervall", "3"), Status.BadInput, "key_interval");
        Fails(with("key_interval", "0"), Status.BadInput, "1 to 1000000");
        Fails(with("topology.still_below", "3"), Status.BadInput, "still_below");
    }
}

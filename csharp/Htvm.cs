// htvm for C#: the C interface (htvm.h) by P/Invoke, and over it a decoder, an encoder and a reader of whole streams.
// Copy this file into a project, with the shared library libhtvm_c beside the program (in Unity: in Assets/Plugins).
// docs/csharp.md is the manual. C# 7.3, no unsafe code; tested with Mono.
//
//     using (var frames = new Htvm.FrameReader(File.OpenRead("person.htvm")))
//         while (frames.Next())
//             Show(frames.Positions, frames.VertexCount, frames.Indices, frames.IndexCount);
//
// Lengths are millimetres, times microseconds. An object is used by one thread at a time.
using System;
using System.Collections.Generic;
using System.IO;
using System.Runtime.InteropServices;
using System.Text;

namespace Htvm
{
    // What the library's functions return; HtvmException has one of the negative ones.
    public enum Status
    {
        Ok = 0,
        Again = 1,
        End = 2,
        BadInput = -1,
        CorruptStream = -2,
        Unsupported = -3,
        Limit = -4,
        OutOfMemory = -5,
        BufferTooSmall = -6,
        Internal = -7,
    }

    public enum FrameKind : uint
    {
        Intra = 0,
        Enhanced = 1,
        Predicted = 2,
        Tracked = 3,
        Patched = 4,
    }

    // Why an I- or TP-frame was sent where a smaller one might have done.
    public enum FrameReason : uint
    {
        None = 0,    // it is not told, as of the first frame
        Due = 1,     // the longest key interval has passed, the caller asks for it, or there is nothing to refer to
        Patches = 2, // whoever joins late would need too many patches
        Surface = 3, // the reference fits worse than it could, over all the surface
        Region = 4,  // the reference does not fit in one region, such as a hand
        Strays = 5,  // too much of the surface is far from the reference
        Border = 6,  // surface was captured that the reference does not have
        Texture = 7, // the capture's texture atlas is laid out anew
        Rate = 8,    // a frame that refers to another would take more bits
        Cut = 9,     // the picture would fall apart: a cut, or another person
    }

    [Flags]
    public enum Attributes : uint
    {
        Colours = 1,
        Normals = 2,
        Texcoords = 4,
        MovingTexcoords = 8, // a camera's projection of the positions, others in each frame whatever its topology
    }

    // Where the subject's head is.
    public enum Up : uint
    {
        Unknown = 0,
        X = 1,
        MinusX = 2,
        Y = 3,
        MinusY = 4,
        Z = 5,
        MinusZ = 6,
    }

    public enum Profile : uint
    {
        Tracked = 0,
        Topology = 1,
        Paper = 2,
    }

    // ---- structs of htvm.h, which explains their fields ---------------------------------------------------------------

    [StructLayout(LayoutKind.Sequential)]
    public struct FrameInfo
    {
        public uint StructSize;
        public FrameKind Type;
        public uint Frame;
        public uint Reference;
        public long TimestampUs;
        public uint SourceVertices, SourceTriangles;
        public uint Vertices, Triangles;
        public Attributes Attributes;
        public uint Joints, Bones;
        public uint Concealed;
        public ulong Bytes;
        public uint Topology;
        public uint Sequence;
        public uint ReferenceTopology; // frames with the same have the same vertices at the same places
        public uint Absent;            // how many vertices are not there
        public FrameReason Reason;
        public uint Reserved;
    }

    // Arrays on loan until the next frame; IntPtr.Zero where the frame does not have the attribute.
    [StructLayout(LayoutKind.Sequential)]
    public struct MeshView
    {
        public uint StructSize;
        public uint Vertices, Triangles;
        public uint Topology;
        public IntPtr Positions; // float, 3 per vertex
        public IntPtr Indices;   // uint, 3 per triangle, counter-clockwise seen from outside
        public IntPtr Colours;   // byte, red, green, blue per vertex
        public IntPtr Normals;   // float, 3 per vertex
        public IntPtr Texcoords; // float, 2 per vertex
        public IntPtr Presence;  // byte, 1 per vertex: 0 where it is not there; IntPtr.Zero: all are
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct SequenceInfo
    {
        public uint StructSize;
        public uint Joints, Bones;
        public uint SkeletonTracked;
        public uint FpsNumerator, FpsDenominator;
        public uint UnitMicrometres;
        public uint NearestVertices;
        public double LatticeStep;
        public ulong Session;
        public uint Sequence;
        public uint StreamVersion;
        public Up Up;
        public uint FloorKnown;
        public double Floor;
        public uint Metadata;
        public uint TextureLayout;
        public uint TextureWidth, TextureHeight;
    }

    // Made by Decoder.Options().
    [StructLayout(LayoutKind.Sequential)]
    public struct DecoderOptions
    {
        public uint StructSize;
        public uint Threads;
        public uint MaxVertices;
        public uint MaxTriangles;
        public uint MaxJoints;
        public uint MaxBones;
        public ulong MaxPacketBytes;
        public ulong MaxMemory;
        public Allocator Allocator;
        public IntPtr RunTasks;
        public IntPtr RunTasksUser;
        public uint DetailLevels;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Allocator
    {
        public IntPtr User;
        public IntPtr Allocate;
        public IntPtr Release;
    }

    // The header of a packet.
    [StructLayout(LayoutKind.Sequential)]
    public struct PacketInfo
    {
        public uint StructSize;
        public uint Kind;
        public uint Flags;
        public uint Frame;
        public uint Reference;
        public uint ReferenceVersion;
        public long TimestampUs;
        public ulong Bytes;
    }

    // ---- functions of htvm.h ------------------------------------------------------------------------------------------

    public static class Native
    {
        const string Library = "htvm_c";

        [StructLayout(LayoutKind.Sequential)]
        public struct Mesh
        {
            public uint StructSize;
            public uint Vertices, Triangles;
            public uint Reserved;
            public IntPtr Positions, Indices, Colours, Normals, Texcoords;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Pose
        {
            public uint StructSize;
            public uint Reserved;
            public IntPtr Joints, Orientations, Tracked;
        }

        [StructLayout(LayoutKind.Sequential)]
        public struct Skeleton
        {
            public uint StructSize;
            public uint Joints, Bones;
            public IntPtr BoneJoints, JointNames, Radii;
        }

        [DllImport(Library)] public static extern IntPtr htvm_version_string();
        [DllImport(Library)] public static extern uint htvm_stream_version();
        [DllImport(Library)] public static extern IntPtr htvm_status_text(Status status);

        [DllImport(Library)] public static extern Status htvm_decoder_options_init(ref DecoderOptions options, UIntPtr struct_size);
        [DllImport(Library)] public static extern Status htvm_decoder_create(ref DecoderOptions options, out IntPtr decoder);
        [DllImport(Library)] public static extern void htvm_decoder_destroy(IntPtr decoder);
        [DllImport(Library)] public static extern IntPtr htvm_decoder_last_error(IntPtr decoder);
        [DllImport(Library)] public static extern Status htvm_decoder_send_packet(IntPtr decoder, byte[] packet, UIntPtr size);
        [DllImport(Library)] public static extern Status htvm_decoder_send_packet(IntPtr decoder, IntPtr packet, UIntPtr size);
        [DllImport(Library)] public static extern Status htvm_decoder_send_bytes(IntPtr decoder, byte[] bytes, UIntPtr size);
        [DllImport(Library)] public static extern Status htvm_decoder_receive_frame(IntPtr decoder, ref FrameInfo info, UIntPtr info_size);
        [DllImport(Library)] public static extern Status htvm_decoder_conceal(IntPtr decoder, uint frame, long timestamp_us, ref FrameInfo info, UIntPtr info_size);
        [DllImport(Library)] public static extern Status htvm_decoder_discard(IntPtr decoder);
        [DllImport(Library)] public static extern Status htvm_decoder_unused_bytes(IntPtr decoder, out ulong damaged, out ulong pending);
        [DllImport(Library)] public static extern Status htvm_decoder_view(IntPtr decoder, ref MeshView view, UIntPtr view_size);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_positions(IntPtr decoder, IntPtr positions, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_positions(IntPtr decoder, float[] positions, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_triangles(IntPtr decoder, IntPtr indices, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_triangles(IntPtr decoder, int[] indices, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_colours(IntPtr decoder, IntPtr rgb, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_colours(IntPtr decoder, byte[] rgb, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_normals(IntPtr decoder, IntPtr normals, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_normals(IntPtr decoder, float[] normals, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_texcoords(IntPtr decoder, IntPtr texcoords, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_texcoords(IntPtr decoder, float[] texcoords, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_joints(IntPtr decoder, double[] joints, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_copy_orientations(IntPtr decoder, double[] rotations, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_sequence(IntPtr decoder, ref SequenceInfo info, UIntPtr info_size);
        [DllImport(Library)] public static extern Status htvm_decoder_joint_name(IntPtr decoder, uint joint, byte[] name, UIntPtr capacity);
        [DllImport(Library)] public static extern Status htvm_decoder_bone(IntPtr decoder, uint bone, out uint first, out uint second, out double radius);
        [DllImport(Library)] public static extern Status htvm_decoder_metadata(IntPtr decoder, uint entry, byte[] key, UIntPtr key_capacity, byte[] value, UIntPtr value_capacity);

        [DllImport(Library)] public static extern Status htvm_packet_read(IntPtr packet, UIntPtr size, ref PacketInfo info, UIntPtr info_size);
        [DllImport(Library)] public static extern Status htvm_packet_header_read(IntPtr bytes, UIntPtr size, ref PacketInfo info, UIntPtr info_size);
        [DllImport(Library)] public static extern Status htvm_dependencies_create(IntPtr allocator, out IntPtr dependencies);
        [DllImport(Library)] public static extern void htvm_dependencies_destroy(IntPtr dependencies);
        [DllImport(Library)] public static extern Status htvm_dependencies_push(IntPtr dependencies, ref PacketInfo info, out ulong place);
        [DllImport(Library)] public static extern Status htvm_dependencies_kept(IntPtr dependencies, [Out] ulong[] places, UIntPtr capacity, out UIntPtr count);
        [DllImport(Library)] public static extern Status htvm_dependencies_frame(IntPtr dependencies, out uint frame);

        [DllImport(Library)] public static extern Status htvm_encoder_options_create(Profile profile, IntPtr allocator, out IntPtr options);
        [DllImport(Library)] public static extern void htvm_encoder_options_destroy(IntPtr options);
        [DllImport(Library)] public static extern IntPtr htvm_encoder_options_last_error(IntPtr options);
        [DllImport(Library)] public static extern Status htvm_encoder_options_set(IntPtr options, byte[] name, byte[] value);
        [DllImport(Library)] public static extern Status htvm_decoder_global_shift(IntPtr decoder, [Out] long[] shift);
        [DllImport(Library)] public static extern Status htvm_encoder_options_add_metadata(IntPtr options, byte[] key, byte[] value);
        [DllImport(Library)] public static extern Status htvm_encoder_options_set_floor(IntPtr options, double floor);
        [DllImport(Library)] public static extern Status htvm_encoder_options_set_global_shift(IntPtr options, long[] shift);
        [DllImport(Library)] public static extern Status htvm_encoder_options_set_skeleton(IntPtr options, ref Skeleton skeleton);
        [DllImport(Library)] public static extern void htvm_quality_steps(double quality, out double geometry_step, out double colour_step);
        [DllImport(Library)] public static extern Status htvm_encoder_create(IntPtr options, out IntPtr encoder, byte[] text, UIntPtr text_capacity);
        [DllImport(Library)] public static extern void htvm_encoder_destroy(IntPtr encoder);
        [DllImport(Library)] public static extern IntPtr htvm_encoder_last_error(IntPtr encoder);
        [DllImport(Library)] public static extern Status htvm_encoder_send_mesh(IntPtr encoder, ref Mesh mesh, IntPtr pose, long timestamp_us, int force_intra);
        [DllImport(Library)] public static extern Status htvm_encoder_set_bitrate(IntPtr encoder, double bits_per_second);
        [DllImport(Library)] public static extern Status htvm_encoder_set_effort(IntPtr encoder, uint effort);
        [DllImport(Library)] public static extern Status htvm_encoder_finish(IntPtr encoder);
        [DllImport(Library)] public static extern Status htvm_encoder_receive_packet(IntPtr encoder, byte[] buffer, UIntPtr capacity, out UIntPtr size);
        [DllImport(Library)] public static extern Status htvm_encoder_front_index(IntPtr encoder, byte[] buffer, UIntPtr capacity, out UIntPtr size);
        [DllImport(Library)] public static extern Status htvm_encoder_last_frame(IntPtr encoder, ref FrameInfo info, UIntPtr info_size);

        // Sizes in bytes of structs and arrays, as the functions take them.
        public static UIntPtr SizeOf<T>() { return (UIntPtr)(uint)Marshal.SizeOf(typeof(T)); }
        public static UIntPtr Count(long count) { return (UIntPtr)(ulong)count; }

        public static string Text(IntPtr utf8)
        {
            int length = 0;
            while (Marshal.ReadByte(utf8, length) != 0) ++length;
            var bytes = new byte[length];
            Marshal.Copy(utf8, bytes, 0, length);
            return Encoding.UTF8.GetString(bytes);
        }

        public static string Text(byte[] utf8) { return Encoding.UTF8.GetString(utf8, 0, Array.IndexOf<byte>(utf8, 0)); }
        public static byte[] Utf8(string text) { return Encoding.UTF8.GetBytes(text + "\0"); }
    }

    // A failed call: what was wrong in one sentence, and of which kind.
    public class HtvmException : Exception
    {
        public readonly Status Status;

        public HtvmException(Status status, string message)
            : base(string.IsNullOrEmpty(message) ? Native.Text(Native.htvm_status_text(status)) : message)
        {
            Status = status;
        }
    }

    // ---- decoding -----------------------------------------------------------------------------------------------------

    // Send bytes as they come, or whole packets, and receive frames until there is none. FrameReader does it for streams.
    public sealed class Decoder : IDisposable
    {
        IntPtr handle;

        // The defaults, to be changed and given to the constructor.
        public static DecoderOptions Options()
        {
            var options = new DecoderOptions();
            var status = Native.htvm_decoder_options_init(ref options, Native.SizeOf<DecoderOptions>());
            if (status != Status.Ok) throw new HtvmException(status, null);
            return options;
        }

        public Decoder() : this(Options()) { }

        public Decoder(DecoderOptions options)
        {
            var status = Native.htvm_decoder_create(ref options, out handle);
            if (status != Status.Ok) throw new HtvmException(status, null);
        }

        ~Decoder() { Destroy(); }

        public void Dispose()
        {
            Destroy();
            GC.SuppressFinalize(this);
        }

        void Destroy()
        {
            Native.htvm_decoder_destroy(handle);
            handle = IntPtr.Zero;
        }

        // Also keeps the decoder alive until the call has returned.
        Status Check(Status status)
        {
            if (status < 0)
                throw new HtvmException(status, handle == IntPtr.Zero
                    ? "the decoder was disposed of" : Native.Text(Native.htvm_decoder_last_error(handle)));
            GC.KeepAlive(this);
            return status;
        }

        // The next piece of a stream: the first `count` bytes of the array.
        public void SendBytes(byte[] bytes, int count)
        {
            if (count < 0 || count > bytes.Length) throw new ArgumentOutOfRangeException("count");
            Check(Native.htvm_decoder_send_bytes(handle, bytes, Native.Count(count)));
        }

        // One whole packet, for transports that keep packets apart. False: receive the frame of the one before first.
        public bool SendPacket(byte[] packet)
        {
            return Check(Native.htvm_decoder_send_packet(handle, packet, Native.Count(packet.Length))) == Status.Ok;
        }

        public bool SendPacket(IntPtr packet, int size)
        {
            return Check(Native.htvm_decoder_send_packet(handle, packet, Native.Count(size))) == Status.Ok;
        }

        // Decodes the next frame, which becomes the current one. False: none until more is sent. After an exception go on
        // calling: it cost one packet.
        public bool ReceiveFrame(out FrameInfo info)
        {
            info = new FrameInfo();
            return Check(Native.htvm_decoder_receive_frame(handle, ref info, Native.SizeOf<FrameInfo>())) == Status.Ok;
        }

        // Makes the current frame a stand-in for one that did not arrive. False before any I-frame.
        public bool Conceal(uint frame, long timestampUs, out FrameInfo info)
        {
            info = new FrameInfo();
            return Check(Native.htvm_decoder_conceal(
                handle, frame, timestampUs, ref info, Native.SizeOf<FrameInfo>())) == Status.Ok;
        }

        // Before a seek: forgets what was sent and not received.
        public void Discard() { Check(Native.htvm_decoder_discard(handle)); }

        // Bytes that are damaged, and those that form no whole packet yet.
        public void UnusedBytes(out ulong damaged, out ulong pending)
        {
            Check(Native.htvm_decoder_unused_bytes(handle, out damaged, out pending));
        }

        // The current frame's arrays on loan until the next is received: what NativeArray is made of without a copy.
        public MeshView View()
        {
            var view = new MeshView();
            Check(Native.htvm_decoder_view(handle, ref view, Native.SizeOf<MeshView>()));
            return view;
        }

        // Copies of the current frame's arrays. Each has a second form for memory that is not an array, such as a
        // NativeArray's; capacity counts numbers.
        public void CopyPositions(float[] to) { Check(Native.htvm_decoder_copy_positions(handle, to, Native.Count(to.Length))); }
        public void CopyPositions(IntPtr to, int capacity) { Check(Native.htvm_decoder_copy_positions(handle, to, Native.Count(capacity))); }
        public void CopyIndices(int[] to) { Check(Native.htvm_decoder_copy_triangles(handle, to, Native.Count(to.Length))); }
        public void CopyIndices(IntPtr to, int capacity) { Check(Native.htvm_decoder_copy_triangles(handle, to, Native.Count(capacity))); }
        public void CopyColours(byte[] to) { Check(Native.htvm_decoder_copy_colours(handle, to, Native.Count(to.Length))); }
        public void CopyColours(IntPtr to, int capacity) { Check(Native.htvm_decoder_copy_colours(handle, to, Native.Count(capacity))); }
        public void CopyNormals(float[] to) { Check(Native.htvm_decoder_copy_normals(handle, to, Native.Count(to.Length))); }
        public void CopyNormals(IntPtr to, int capacity) { Check(Native.htvm_decoder_copy_normals(handle, to, Native.Count(capacity))); }
        public void CopyTexcoords(float[] to) { Check(Native.htvm_decoder_copy_texcoords(handle, to, Native.Count(to.Length))); }
        public void CopyTexcoords(IntPtr to, int capacity) { Check(Native.htvm_decoder_copy_texcoords(handle, to, Native.Count(capacity))); }
        public void CopyJoints(double[] to) { Check(Native.htvm_decoder_copy_joints(handle, to, Native.Count(to.Length))); }
        public void CopyOrientations(double[] to) { Check(Native.htvm_decoder_copy_orientations(handle, to, Native.Count(to.Length))); }

        // What the sequence header says. False until one was decoded.
        public bool Sequence(out SequenceInfo info)
        {
            info = new SequenceInfo();
            return Check(Native.htvm_decoder_sequence(handle, ref info, Native.SizeOf<SequenceInfo>())) == Status.Ok;
        }

        public string JointName(uint joint)
        {
            var name = new byte[256];
            Check(Native.htvm_decoder_joint_name(handle, joint, name, Native.Count(name.Length)));
            return Native.Text(name);
        }

        public void Bone(uint bone, out uint first, out uint second, out double radius)
        {
            Check(Native.htvm_decoder_bone(handle, bone, out first, out second, out radius));
        }

        // Millimetres that were taken off the capture's coordinates: added to positions, they give these back.
        public long[] GlobalShift()
        {
            var shift = new long[3];
            Check(Native.htvm_decoder_global_shift(handle, shift));
            return shift;
        }

        // Title, rights and other texts.
        public Dictionary<string, string> Metadata()
        {
            var texts = new Dictionary<string, string>();
            SequenceInfo info;
            Sequence(out info);
            byte[] key = new byte[256], value = new byte[4096];
            for (uint entry = 0; entry < info.Metadata; ++entry)
            {
                Check(Native.htvm_decoder_metadata(handle, entry, key, Native.Count(key.Length), value, Native.Count(value.Length)));
                texts[Native.Text(key)] = Native.Text(value);
            }
            return texts;
        }
    }

    // A decoder's current frame in arrays that are used again for the next one: they grow with the largest frame, and only
    // their beginning, as long as the counts say, belongs to this one.
    public sealed class Frame
    {
        uint? topology, referenceTopology;

        public FrameInfo Info { get; private set; }
        public int VertexCount { get { return (int)Info.Vertices; } }
        public int IndexCount { get { return 3 * (int)Info.Triangles; } }
        // Whether triangles may differ from those of the frame taken before.
        public bool TopologyChanged { get; private set; }
        // Whether the vertices are others than in the frame taken before, and so may be texture coordinates.
        public bool ReferenceChanged { get; private set; }
        public float[] Positions = new float[0]; // 3 per vertex, mm
        public int[] Indices = new int[0];       // 3 per triangle, counter-clockwise seen from outside
        public byte[] Colours = new byte[0];     // 3 per vertex; valid if Info.Attributes has Attributes.Colours, and so on
        public float[] Normals = new float[0];   // 3 per vertex
        public float[] Texcoords = new float[0]; // 2 per vertex
        public byte[] Presence = new byte[0];    // 1 per vertex: 0 where it is not there; valid if Info.Absent is not 0

        // info: of the frame that the decoder has just received, always the same decoder.
        public void Take(Decoder decoder, FrameInfo info)
        {
            Info = info;
            TopologyChanged = topology != info.Topology;
            topology = info.Topology;
            ReferenceChanged = referenceTopology != info.ReferenceTopology;
            referenceTopology = info.ReferenceTopology;
            int vertices = VertexCount;
            Grow(ref Positions, 3 * vertices);
            decoder.CopyPositions(Positions);
            if (TopologyChanged)
            {
                Grow(ref Indices, IndexCount);
                decoder.CopyIndices(Indices);
            }
            if (Has(Attributes.Colours))
            {
                Grow(ref Colours, 3 * vertices);
                decoder.CopyColours(Colours);
            }
            if (Has(Attributes.Normals))
            {
                Grow(ref Normals, 3 * vertices);
                decoder.CopyNormals(Normals);
            }
            if (Has(Attributes.Texcoords) && (ReferenceChanged || Has(Attributes.MovingTexcoords)))
            {
                Grow(ref Texcoords, 2 * vertices);
                decoder.CopyTexcoords(Texcoords);
            }
            if (Info.Absent > 0)
            {
                Grow(ref Presence, vertices);
                Marshal.Copy(decoder.View().Presence, Presence, 0, vertices);
            }
        }

        public bool Has(Attributes attribute) { return (Info.Attributes & attribute) != 0; }

        static void Grow<T>(ref T[] array, int count)
        {
            if (array.Length < count) array = new T[Math.Max(count, Math.Min(2 * array.Length, 1 << 28))];
        }
    }

    // The frames of a stream, one after the other.
    public sealed class FrameReader : IDisposable
    {
        public readonly Decoder Decoder;
        public readonly Frame Frame = new Frame(); // the one that Next has read
        readonly System.IO.Stream source;
        readonly byte[] piece = new byte[1 << 16];
        bool ended;

        // source: is disposed of with the reader. It may be a file, a socket's stream, or any other.
        public FrameReader(System.IO.Stream source) : this(source, Decoder.Options()) { }

        public FrameReader(System.IO.Stream source, DecoderOptions options)
        {
            this.source = source;
            Decoder = new Decoder(options);
        }

        // The frame's.
        public FrameInfo Info { get { return Frame.Info; } }
        public int VertexCount { get { return Frame.VertexCount; } }
        public int IndexCount { get { return Frame.IndexCount; } }
        public bool TopologyChanged { get { return Frame.TopologyChanged; } }
        public bool ReferenceChanged { get { return Frame.ReferenceChanged; } }
        public float[] Positions { get { return Frame.Positions; } }
        public int[] Indices { get { return Frame.Indices; } }
        public byte[] Colours { get { return Frame.Colours; } }
        public float[] Normals { get { return Frame.Normals; } }
        public float[] Texcoords { get { return Frame.Texcoords; } }
        public byte[] Presence { get { return Frame.Presence; } }
        public bool Has(Attributes attribute) { return Frame.Has(attribute); }

        // Reads the next frame. False at the end of the stream. An exception costs the packet that it is about: call
        // again for the frames behind it.
        public bool Next()
        {
            FrameInfo info;
            while (!Decoder.ReceiveFrame(out info))
            {
                if (ended) return false;
                int count = source.Read(piece, 0, piece.Length);
                if (count > 0)
                {
                    Decoder.SendBytes(piece, count);
                    continue;
                }
                ended = true;
                ulong damaged, pending;
                Decoder.UnusedBytes(out damaged, out pending);
                if (damaged + pending > 0)
                    throw new HtvmException(Status.CorruptStream, string.Format(
                        "{0} bytes of the stream are damaged, and {1} at its end are a packet cut short", damaged, pending));
                return false;
            }
            Frame.Take(Decoder, info);
            return true;
        }

        public void Dispose()
        {
            Decoder.Dispose();
            source.Dispose();
        }
    }

    // ---- encoding -----------------------------------------------------------------------------------------------------

    // The skeleton of a capture, constant over its sequence.
    public sealed class Skeleton
    {
        public string[] JointNames;
        public ushort[] BoneJoints; // 2 per bone: the joint that it turns about, and the other one
        public double[] Radii;      // mm, one per bone; null: calibrated on the first frame
    }

    // Its place in one frame.
    public sealed class Pose
    {
        public double[] Joints;       // mm, 3 per joint
        public double[] Orientations; // 9 per bone; null: derived from the joints
        public byte[] Tracked;        // one per joint, 0: the position is a guess; null: all are tracked
    }

    // Codes meshes into packets; a stream in a file is the sequence of its packets.
    public sealed class Encoder : IDisposable
    {
        IntPtr handle;
        readonly int joints, bones;

        // options: by the names in docs/options.md, such as { "key_interval", "60" }; with a decimal point, whatever the
        // culture. quality: 0 to 100; null: 42, as of `htvm encode`.
        public Encoder(Profile profile = Profile.Tracked, double? quality = null, Skeleton skeleton = null,
                       IDictionary<string, string> options = null, IDictionary<string, string> metadata = null,
                       double? floor = null, long[] globalShift = null)
        {
            IntPtr set;
            var status = Native.htvm_encoder_options_create(profile, IntPtr.Zero, out set);
            if (status != Status.Ok) throw new HtvmException(status, null);
            try
            {
                if (quality.HasValue) Set(set, "quality", Number(quality.Value));
                if (options != null)
                    foreach (var option in options) Set(set, option.Key, option.Value);
                if (metadata != null)
                    foreach (var text in metadata)
                        CheckOptions(set, Native.htvm_encoder_options_add_metadata(set, Native.Utf8(text.Key), Native.Utf8(text.Value)));
                if (floor.HasValue) CheckOptions(set, Native.htvm_encoder_options_set_floor(set, floor.Value));
                if (globalShift != null)
                {
                    if (globalShift.Length != 3) throw new ArgumentException("a global shift has three numbers");
                    CheckOptions(set, Native.htvm_encoder_options_set_global_shift(set, globalShift));
                }
                if (skeleton != null)
                {
                    joints = skeleton.JointNames.Length;
                    bones = skeleton.BoneJoints.Length / 2;
                    SetSkeleton(set, skeleton);
                }
                var text512 = new byte[512];
                status = Native.htvm_encoder_create(set, out handle, text512, Native.Count(text512.Length));
                if (status != Status.Ok) throw new HtvmException(status, Native.Text(text512));
            }
            finally
            {
                Native.htvm_encoder_options_destroy(set);
            }
        }

        ~Encoder() { Destroy(); }

        public void Dispose()
        {
            Destroy();
            GC.SuppressFinalize(this);
        }

        void Destroy()
        {
            Native.htvm_encoder_destroy(handle);
            handle = IntPtr.Zero;
        }

        static string Number(double value)
        {
            return value.ToString("R", System.Globalization.CultureInfo.InvariantCulture);
        }

        static void CheckOptions(IntPtr options, Status status)
        {
            if (status != Status.Ok)
                throw new HtvmException(status, Native.Text(Native.htvm_encoder_options_last_error(options)));
        }

        static void Set(IntPtr options, string name, string value)
        {
            CheckOptions(options, Native.htvm_encoder_options_set(options, Native.Utf8(name), Native.Utf8(value)));
        }

        static void SetSkeleton(IntPtr options, Skeleton skeleton)
        {
            if (skeleton.Radii != null && skeleton.Radii.Length != skeleton.BoneJoints.Length / 2)
                throw new HtvmException(Status.BadInput, "there is not one radius for each bone");
            using (var pins = new Pins())
            {
                var names = new IntPtr[skeleton.JointNames.Length];
                for (int joint = 0; joint < names.Length; ++joint) names[joint] = pins.Add(Native.Utf8(skeleton.JointNames[joint]));
                var given = new Native.Skeleton
                {
                    StructSize = (uint)Marshal.SizeOf(typeof(Native.Skeleton)),
                    Joints = (uint)names.Length,
                    Bones = (uint)skeleton.BoneJoints.Length / 2,
                    BoneJoints = pins.Add(skeleton.BoneJoints),
                    JointNames = pins.Add(names),
                    Radii = pins.Add(skeleton.Radii),
                };
                CheckOptions(options, Native.htvm_encoder_options_set_skeleton(options, ref given));
            }
        }

        Status Check(Status status)
        {
            if (status < 0)
                throw new HtvmException(status, handle == IntPtr.Zero
                    ? "the encoder was disposed of" : Native.Text(Native.htvm_encoder_last_error(handle)));
            GC.KeepAlive(this);
            return status;
        }

        // Codes a frame and returns the packets that it gave. Attributes that the mesh does not have are null. Timestamps
        // must ascend. After an exception the frame is not part of the stream, and the next may follow.
        public List<byte[]> Push(float[] positions, int[] indices, byte[] colours, long timestampUs, Pose pose = null,
                                 float[] normals = null, float[] texcoords = null, bool forceIntra = false)
        {
            int vertices = positions.Length / 3;
            Require(positions, 3 * vertices, "positions");
            Require(indices, indices.Length / 3 * 3, "indices");
            Require(colours, 3 * vertices, "colours");
            Require(normals, 3 * vertices, "normals");
            Require(texcoords, 2 * vertices, "texcoords");
            using (var pins = new Pins())
            {
                var mesh = new Native.Mesh
                {
                    StructSize = (uint)Marshal.SizeOf(typeof(Native.Mesh)),
                    Vertices = (uint)vertices,
                    Triangles = (uint)indices.Length / 3,
                    Positions = pins.Add(positions),
                    Indices = pins.Add(indices),
                    Colours = pins.Add(colours),
                    Normals = pins.Add(normals),
                    Texcoords = pins.Add(texcoords),
                };
                var placed = IntPtr.Zero;
                if (pose != null)
                {
                    Require(pose.Joints, 3 * joints, "the pose's joints");
                    Require(pose.Orientations, 9 * bones, "the pose's orientations");
                    Require(pose.Tracked, joints, "the pose's tracked");
                    // An array of one struct: what can be pinned.
                    placed = pins.Add(new[] { new Native.Pose
                    {
                        StructSize = (uint)Marshal.SizeOf(typeof(Native.Pose)),
                        Joints = pins.Add(pose.Joints),
                        Orientations = pins.Add(pose.Orientations),
                        Tracked = pins.Add(pose.Tracked),
                    } });
                }
                Check(Native.htvm_encoder_send_mesh(handle, ref mesh, placed, timestampUs, forceIntra ? 1 : 0));
            }
            return Receive();
        }

        // Sets the bits per second that the line carries from the next frame on; the quality follows within half a second.
        // For an encoder that was made with a bitrate.
        public void SetBitrate(double bitsPerSecond)
        {
            Check(Native.htvm_encoder_set_bitrate(handle, bitsPerSecond));
        }

        // Sets how much is searched for each frame from the next on: 1 to 9, as the option tracked.effort. 0, for a frame
        // that would be late otherwise: its motion alone is coded.
        public void SetEffort(uint effort)
        {
            Check(Native.htvm_encoder_set_effort(handle, effort));
        }

        // Ends the stream, and returns its last packets.
        public List<byte[]> Finish()
        {
            Check(Native.htvm_encoder_finish(handle));
            return Receive();
        }

        // After Finish(): the index that a file begins with, to be put in front of all packets but the last. Null if there
        // was no frame.
        public byte[] FrontIndex()
        {
            UIntPtr size;
            var status = Native.htvm_encoder_front_index(handle, null, UIntPtr.Zero, out size);
            if (status == Status.Again) throw new HtvmException(Status.BadInput, "the index is known once the stream is finished");
            if (status == Status.End) return null;
            if (status != Status.BufferTooSmall) Check(status);
            var index = new byte[(int)size.ToUInt64()];
            Check(Native.htvm_encoder_front_index(handle, index, size, out size));
            return index;
        }

        // What became of the last mesh. False before any.
        public bool LastFrame(out FrameInfo info)
        {
            info = new FrameInfo();
            return Check(Native.htvm_encoder_last_frame(handle, ref info, Native.SizeOf<FrameInfo>())) == Status.Ok;
        }

        static void Require(Array array, int length, string name)
        {
            if (array != null && array.Length != length)
                throw new HtvmException(Status.BadInput, string.Format("{0} must have {1} numbers, not {2}", name, length, array.Length));
        }

        List<byte[]> Receive()
        {
            var packets = new List<byte[]>();
            for (;;)
            {
                UIntPtr size;
                var status = Native.htvm_encoder_receive_packet(handle, null, UIntPtr.Zero, out size);
                if (status == Status.Again || status == Status.End) return packets;
                if (status != Status.BufferTooSmall) Check(status);
                var packet = new byte[(int)size.ToUInt64()];
                Check(Native.htvm_encoder_receive_packet(handle, packet, size, out size));
                packets.Add(packet);
            }
        }

        // Arrays that stay where they are during a call.
        sealed class Pins : IDisposable
        {
            readonly List<GCHandle> pins = new List<GCHandle>();

            public IntPtr Add(Array array)
            {
                if (array == null) return IntPtr.Zero;
                pins.Add(GCHandle.Alloc(array, GCHandleType.Pinned));
                return pins[pins.Count - 1].AddrOfPinnedObject();
            }

            public void Dispose()
            {
                foreach (var pin in pins) pin.Free();
            }
        }
    }
}

// The Unity package, played against the stand-in: Program.exe FOLDER        FOLDER: of the conformance streams
//                                                 Program.exe live ADDRESS STREAM HTVM PUBLISH_ADDRESS
using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Threading;
using Htvm;
using UnityEngine;

static class Program
{
    static void Require(bool fact, string what)
    {
        if (!fact) throw new Exception("not so: " + what);
    }

    static void Call(object component, string message)
    {
        var method = component.GetType().GetMethod(message, BindingFlags.Instance | BindingFlags.NonPublic);
        ((Action)Delegate.CreateDelegate(typeof(Action), component, method))();
    }

    // What Unity calls once a picture, without what reflection allocates.
    static Action Updates(HtvmPlayer player)
    {
        var method = typeof(HtvmPlayer).GetMethod("Update", BindingFlags.Instance | BindingFlags.NonPublic);
        return (Action)Delegate.CreateDelegate(typeof(Action), player, method);
    }

    static HtvmPlayer Player() { return new GameObject("person", typeof(MeshFilter), typeof(MeshRenderer)).AddComponent<HtvmPlayer>(); }
    static Mesh Shown(HtvmPlayer player) { return player.GetComponent<MeshFilter>().sharedMesh; }

    // What a frame is as, so that meshes can be compared with it.
    sealed class Expected
    {
        public long us;
        public float[] positions, normals, texcoords;
        public byte[] colours, presence;
        public int[] indices;
        public Up up;
    }

    static List<Expected> Frames(byte[] stream)
    {
        var all = new List<Expected>();
        using (var frames = new FrameReader(new MemoryStream(stream)))
            while (frames.Next())
            {
                SequenceInfo sequence;
                frames.Decoder.Sequence(out sequence);
                int n = frames.VertexCount;
                all.Add(new Expected
                {
                    us = frames.Info.TimestampUs,
                    positions = frames.Positions.Take(3 * n).ToArray(),
                    indices = frames.Indices.Take(frames.IndexCount).ToArray(),
                    colours = frames.Has(Attributes.Colours) ? frames.Colours.Take(3 * n).ToArray() : null,
                    normals = frames.Has(Attributes.Normals) ? frames.Normals.Take(3 * n).ToArray() : null,
                    texcoords = frames.Has(Attributes.Texcoords) ? frames.Texcoords.Take(2 * n).ToArray() : null,
                    presence = frames.Info.Absent > 0 ? frames.Presence.Take(n).ToArray() : null,
                    up = sequence.Up,
                });
            }
        return all;
    }

    // Whether the mesh is that frame, for streams whose y is up or not told.
    static bool Is(Mesh mesh, Expected frame)
    {
        int n = frame.positions.Length / 3;
        if (mesh.vertexCount != n || mesh.indexCount != frame.indices.Length) return false;
        for (int v = 0; v < n; ++v)
        {
            if (mesh.vertices[v].x != -0.001f * frame.positions[3 * v] || mesh.vertices[v].y != 0.001f * frame.positions[3 * v + 1] ||
                mesh.vertices[v].z != 0.001f * frame.positions[3 * v + 2]) return false;
            if (frame.colours != null && mesh.colours[v].g != frame.colours[3 * v + 1]) return false;
            if (frame.normals != null && mesh.normals[v].x != -frame.normals[3 * v]) return false;
            if (frame.texcoords != null && mesh.texcoords[v].y != 1 - frame.texcoords[2 * v + 1]) return false;
        }
        for (int i = 0; i < frame.indices.Length; i += 3)
            if (mesh.indices[i] != frame.indices[i] || mesh.indices[i + 1] != frame.indices[i + 2] ||
                mesh.indices[i + 2] != frame.indices[i + 1]) return false;
        return frame.normals != null || mesh.recalculated > 0;
    }

    static int Main(string[] arguments)
    {
        if (arguments[0] == "live")
        {
            ALiveStreamIsShownAsItComesAndAgainAfterItsEnd(arguments[1], arguments[2], arguments[3], arguments[4]);
            return 0;
        }
        var folder = arguments[0];
        Application.streamingAssetsPath = folder;
        foreach (var name in new[] { "tracked_2", "patched_4", "no_skeleton_all_attributes", "presence_7", "grouped_5", "charts_6" })
            EveryFrameIsShownInOrderAndAgain(folder, name + ".htvm");
        var stream = File.ReadAllBytes(Path.Combine(folder, "tracked_2.htvm"));
        WithoutLoopTheLastFrameStaysAndPlayBeginsAnew(stream);
        SeekShowsTheFrameOfThatTimeAndPauseHoldsIt(stream);
        LateFramesArePassedOver(stream);
        WhatIsWrongIsTold(stream);
        OtherUpAxesAreTurned();
        AbsentVerticesAreOutOfTheBounds(File.ReadAllBytes(Path.Combine(folder, "presence_7.htvm")));
        FramesMakeNoGarbage(stream);
        TheImporterMakesAssets(folder);
        TheSamplePutsAPersonBeforeTheCamera(stream);
        Console.WriteLine("15 passed, 0 failed");
        return 0;
    }

    static void EveryFrameIsShownInOrderAndAgain(string folder, string file)
    {
        var expected = Frames(File.ReadAllBytes(Path.Combine(folder, file)));
        var player = Player();
        player.address = file;
        var shown = new List<long>();
        player.Shown += info => shown.Add(info.TimestampUs);
        Call(player, "Start");
        for (int round = 0; round < 2; ++round)
            for (int frame = 0; frame < expected.Count; ++frame)
            {
                double next = frame + 1 < expected.Count ? (expected[frame + 1].us - expected[0].us) / 1e6 : player.Duration;
                UnityEngine.Time.deltaTime = (float)(next - (expected[frame].us - expected[0].us) / 1e6) + 1e-6f;
                player.Seek((expected[frame].us - expected[0].us) / 1e6);
                Call(player, "Update");
                Require(Is(Shown(player), expected[frame]), file + " shows frame " + frame + " in round " + round);
            }
        Require(shown.SequenceEqual(expected.Concat(expected).Select(frame => frame.us)), "each frame of " + file + " is told once");
        Require(UnityEngine.Debug.warnings.Count == 0, "no warnings");
        Call(player, "OnDestroy");
        Require(Shown(player).destroyed, "the mesh is destroyed with the player");
    }

    // The stream at 60 pictures a second, from the clock alone; the frames that were shown.
    static List<long> Play(HtvmPlayer player, byte[] stream, int pictures, float seconds)
    {
        var shown = new List<long>();
        player.Shown += info => shown.Add(info.Frame);
        player.Open(stream);
        player.Play();
        UnityEngine.Time.deltaTime = seconds;
        for (int picture = 0; picture < pictures; ++picture) Call(player, "Update");
        return shown;
    }

    static void WithoutLoopTheLastFrameStaysAndPlayBeginsAnew(byte[] stream)
    {
        var expected = Frames(stream);
        var player = Player();
        player.loop = false;
        var shown = Play(player, stream, 4 * expected.Count, 1 / 60f);
        Require(shown.SequenceEqual(Enumerable.Range(0, expected.Count).Select(n => (long)n)), "each frame once");
        Require(!player.Playing && Is(Shown(player), expected.Last()), "the last stays");
        player.Play();
        Call(player, "Update");
        Require(player.Playing && Is(Shown(player), expected[0]), "it begins anew");
        Call(player, "OnDestroy");
        player = Player();
        shown = Play(player, stream, 4 * expected.Count, 1 / 60f);
        Require(shown.Count >= 2 * expected.Count - 1 && shown[expected.Count] == 0, "with loop it begins anew by itself");
        Call(player, "OnDestroy");
    }

    static void SeekShowsTheFrameOfThatTimeAndPauseHoldsIt(byte[] stream)
    {
        var expected = Frames(stream);
        var player = Player();
        player.Open(stream);
        player.Pause();
        foreach (int frame in new[] { expected.Count - 1, 0, expected.Count / 2, 1 })
        {
            player.Seek((expected[frame].us - expected[0].us) / 1e6);
            for (int picture = 0; picture < 3; ++picture) Call(player, "Update");
            Require(Is(Shown(player), expected[frame]), "frame " + frame + " after a seek");
        }
        player.Seek(1e9);
        Call(player, "Update");
        Require(Is(Shown(player), expected.Last()), "behind the end is the last frame");
        Call(player, "OnDestroy");
    }

    static void LateFramesArePassedOver(byte[] stream)
    {
        var player = Player();
        var shown = Play(player, stream, 3, 2.5f / 30);
        Require(shown.SequenceEqual(new long[] { 0, 2, 5 }), "the due frames alone: " + string.Join(" ", shown));
        Call(player, "OnDestroy");
    }

    static void WhatIsWrongIsTold(byte[] stream)
    {
        var told = new List<string>();
        var player = Player();
        player.Failed += told.Add;
        player.Open("nothing.htvm");
        Require(told.Count == 1 && told[0].Contains("nothing.htvm"), "which file is not there");
        player.Open(new byte[100]);
        Require(told.Count == 2 && told[1].Contains("no frame of an htvm stream"), "what is no stream");
        Call(player, "Update");
        var damaged = (byte[])stream.Clone();
        damaged[damaged.Length / 2] ^= 1;
        Play(player, damaged, 100, 1 / 60f);
        Require(told.Skip(2).All(text => text.Contains("refers to")) && Shown(player).vertexCount > 0, "what cannot be decoded");
        Call(player, "OnDestroy");
        UnityEngine.Debug.warnings.Clear();
    }

    // A triangle, with each axis up in turn: its top is up in Unity, and its front stays in front.
    static void OtherUpAxesAreTurned()
    {
        var tops = new Dictionary<string, float[]>
        {
            { "x", new float[] { 100, 0, 0 } }, { "-x", new float[] { -100, 0, 0 } }, { "y", new float[] { 0, 100, 0 } },
            { "-y", new float[] { 0, -100, 0 } }, { "z", new float[] { 0, 0, 100 } }, { "-z", new float[] { 0, 0, -100 } },
        };
        foreach (var top in tops)
        {
            float a = top.Key.EndsWith("x") ? 0 : 50, b = top.Key.EndsWith("x") ? 50 : 0, c = top.Key.EndsWith("y") ? 50 : 0;
            var corners = top.Key.EndsWith("y") ? new float[] { a, 0, 0, 0, 0, c } : new float[] { a, b, 0, 0, a, b };
            var positions = top.Value.Concat(corners).ToArray();
            var options = new Dictionary<string, string> { { "subject_size", "1000" }, { "up", top.Key }, { "tracked.simplify", "0" } };
            var bytes = new List<byte>();
            using (var encoder = new Encoder(quality: 90, options: options))
            {
                encoder.Push(positions, new[] { 0, 1, 2 }, null, 0).ForEach(bytes.AddRange);
                encoder.Finish().ForEach(bytes.AddRange);
            }
            var expected = Frames(bytes.ToArray())[0];
            var player = Player();
            player.Open(bytes.ToArray());
            Call(player, "Update");
            var mesh = Shown(player);
            var highest = mesh.vertices.Take(3).OrderBy(vertex => vertex.y).Last();
            Require(Math.Abs(highest.y - 0.1f) < 0.003f, "the top is up where " + top.Key + " is up");
            // A turn keeps the volume's sign, a mirror image has the other one, and so do triangles that turn the other way.
            Func<float[], float[], float[], float> volume = (p, q, r) =>
                p[0] * (q[1] * r[2] - q[2] * r[1]) - p[1] * (q[0] * r[2] - q[2] * r[0]) + p[2] * (q[0] * r[1] - q[1] * r[0]);
            Func<int, float[]> there = v => new[] { 1000 * mesh.vertices[v].x, 1000 * mesh.vertices[v].y, 1000 * mesh.vertices[v].z };
            Func<int, float[]> here = v => expected.positions.Skip(3 * v).Take(3).ToArray();
            var before = volume(here(0), here(1), here(2));
            Require(Math.Abs(before) > 1e4 && Math.Abs(before + volume(there(0), there(1), there(2))) < 1e-2 * Math.Abs(before),
                    "a turn and one mirror where " + top.Key + " is up");
            Call(player, "OnDestroy");
        }
    }

    static void AbsentVerticesAreOutOfTheBounds(byte[] stream)
    {
        var expected = Frames(stream);
        int absent = expected.FindIndex(frame => frame.presence != null && frame.presence.Contains((byte)0));
        Require(absent >= 0, "a frame shows a part");
        var player = Player();
        player.Open(stream);
        player.Pause();
        player.Seek((expected[absent].us - expected[0].us) / 1e6);
        Call(player, "Update");
        var there = Enumerable.Range(0, expected[absent].presence.Length).Where(v => expected[absent].presence[v] != 0);
        Require(Shown(player).bounds.max.y == there.Max(v => 0.001f * expected[absent].positions[3 * v + 1]) &&
                Shown(player).bounds.min.y == there.Min(v => 0.001f * expected[absent].positions[3 * v + 1]), "the bounds of what is there");
        Call(player, "OnDestroy");
    }

    static readonly object[] kept = new object[1];

    // Bytes allocated by that many calls; the smallest of three tries, since other threads allocate too.
    static long Allocated(Action call, int times)
    {
        long least = long.MaxValue;
        for (int attempt = 0; attempt < 3; ++attempt)
        {
            long before = GC.GetAllocatedBytesForCurrentThread();
            for (int n = 0; n < times; ++n) call();
            least = Math.Min(least, GC.GetAllocatedBytesForCurrentThread() - before);
        }
        return least;
    }

    static void FramesMakeNoGarbage(byte[] stream)
    {
        var player = Player();
        player.Open(stream);
        var update = Updates(player);
        UnityEngine.Time.deltaTime = 1 / 30f;
        for (int picture = 0; picture < 100; ++picture) update(); // arrays have grown, code is compiled
        int collections = GC.CollectionCount(0);
        long bytes = Allocated(update, 2000);
        Require(bytes == 0 && GC.CollectionCount(0) == collections, bytes + " bytes of garbage in 2000 frames");
        // Were there any, it would be seen.
        Require(Allocated(() => kept[0] = new object(), 2000) >= 2000, "an object a frame is noticed");
        Call(player, "OnDestroy");
    }

    static void TheImporterMakesAssets(string folder)
    {
        var context = new UnityEditor.AssetImporters.AssetImportContext { assetPath = Path.Combine(folder, "sequences_3.htvm") };
        new HtvmImporter().OnImportAsset(context);
        var stream = (HtvmStream)context.main;
        Require(context.errors.Count == 0 && stream.title == "a walk" && stream.frames > 18 && stream.seconds > 0.5, "what is in it");
        Require(((Mesh)context.assets["first frame"]).vertexCount == stream.vertices && stream.vertices == 199, "the first frame");
        var wrong = new UnityEditor.AssetImporters.AssetImportContext { assetPath = Path.Combine(folder, "README.md") };
        if (!File.Exists(wrong.assetPath)) wrong.assetPath = Directory.GetFiles(folder, "*.digests")[0];
        new HtvmImporter().OnImportAsset(wrong);
        Require(wrong.errors.Count == 1 && wrong.errors[0].Contains("no frame of an htvm stream"), "an import that fails says why");
    }

    static void TheSamplePutsAPersonBeforeTheCamera(byte[] bytes)
    {
        var sample = new GameObject("scene").AddComponent<PersonBeforeCamera>();
        sample.stream = ScriptableObject.CreateInstance<HtvmStream>();
        sample.stream.bytes = bytes;
        Call(sample, "Start");
        var player = GameObject.all.Last().GetComponent<HtvmPlayer>();
        Call(player, "Start");
        Call(player, "Update");
        Require(Is(Shown(player), Frames(bytes)[0]), "the first frame");
        Require(player.GetComponent<MeshRenderer>().sharedMaterial.shader.name == "Htvm/Vertex colours", "in its colours");
        Call(player, "OnDestroy");
    }

    // Publishes the file twice; the second time the player must have connected again, or have stayed.
    static void ALiveStreamIsShownAsItComesAndAgainAfterItsEnd(string address, string file, string htvm, string publish)
    {
        var expected = Frames(File.ReadAllBytes(file));
        var player = Player();
        player.address = address;
        var shown = new List<uint>();
        player.Shown += info => shown.Add(info.Frame);
        Call(player, "Start");
        var update = Updates(player);
        long garbage = 0;
        for (int round = 0; round < 2; ++round)
        {
            shown.Clear();
            using (var publisher = Process.Start(new ProcessStartInfo(htvm, "publish " + file + " " + publish) { UseShellExecute = false }))
            {
                var until = DateTime.UtcNow.AddSeconds(60);
                while (shown.Count == 0 || shown.Last() != expected.Count - 1)
                {
                    Require(DateTime.UtcNow < until, "round " + round + " is shown up to its last frame; shown: " + string.Join(" ", shown) +
                            "; warnings: " + string.Join("; ", UnityEngine.Debug.warnings));
                    long before = GC.GetAllocatedBytesForCurrentThread();
                    update();
                    garbage = GC.GetAllocatedBytesForCurrentThread() - before;
                    Thread.Sleep(2);
                }
                publisher.WaitForExit();
            }
            Require(Is(Shown(player), expected.Last()), "the last frame");
            Require(shown.Zip(shown.Skip(1), (a, b) => a < b).All(well => well), "in order: " + string.Join(" ", shown));
            Require(shown.Count > 1, "more than one of them");
            Require(garbage == 0, garbage + " bytes of garbage for a frame");
        }
        Call(player, "OnDestroy");
        Console.WriteLine("live: {0} of {1} frames shown; 1 passed, 0 failed", shown.Count, expected.Count);
    }
}

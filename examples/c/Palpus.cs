// palpus for C#: the part of include/palpus.h that a haptic loop needs. Works in Unity unchanged,
// together with the native library. docs/c.md explains how to use this file.
using System;
using System.Runtime.InteropServices;
using System.Text;

namespace Palpus
{
    [StructLayout(LayoutKind.Sequential)]
    public struct Vector { public double X, Y, Z; public Vector(double x, double y, double z) { X = x; Y = y; Z = z; } }

    /// Position (m) and unit quaternion (x, y, z, w).
    [StructLayout(LayoutKind.Sequential)]
    public struct Pose
    {
        public Vector Position;
        public double Qx, Qy, Qz, Qw;
        public static Pose At(double x, double y, double z) { return new Pose { Position = new Vector(x, y, z), Qw = 1 }; }
    }

    /// Velocity, m/s and rad/s.
    [StructLayout(LayoutKind.Sequential)] public struct Twist { public Vector Linear, Angular; }
    /// Force and torque, N and N m.
    [StructLayout(LayoutKind.Sequential)] public struct Wrench { public Vector Force, Torque; }
    [StructLayout(LayoutKind.Sequential)] public struct Probe { public Pose Pose; public Twist Twist; }
    [StructLayout(LayoutKind.Sequential)] public struct BodyHandle { public ulong Id; }
    [StructLayout(LayoutKind.Sequential)] public struct WorldHandle { public ulong Id; }
    [StructLayout(LayoutKind.Sequential)] public struct ObjectHandle { public ulong Id; }
    [StructLayout(LayoutKind.Sequential)] public struct ToolHandle { public ulong Id; }
    [StructLayout(LayoutKind.Sequential)] public struct BodySettings { public double Scale, Flatness; public uint Thick; }
    [StructLayout(LayoutKind.Sequential)]
    public struct Coupling { public double Stiffness, Damping, AngularStiffness, AngularDamping, ContactOffset, Mass; }
    [StructLayout(LayoutKind.Sequential)] public struct Shading { public double CreaseAngle, MostTurn; }
    [StructLayout(LayoutKind.Sequential)] public struct Friction { public double Static, Dynamic, TangentialStiffness; }
    [StructLayout(LayoutKind.Sequential)] public struct Material { public double Frequency, Decay, Gain; }
    [StructLayout(LayoutKind.Sequential)] public struct Limits { public double Force, Torque; }

    [StructLayout(LayoutKind.Sequential)]
    public struct Settings
    {
        public double ContactTolerance, ClusterRadius, Stiffness, Damping, SplitAngle, PatchAngle;
        public Coupling Coupling;
        public Shading Shading;
        public Friction Friction;
        public Material Material;
        public Limits Limits;
        public Vector Grip;
        public ulong Capacity;
        public double TimeBudget;
        public uint SmoothClusters, Saturation, HasCoupling, HasShading, HasFriction, HasMaterial;

        /// Settings of a tool with the largest stiffness that a device with these limits (N, N m)
        /// can render.
        /// period: of the loop, s. tolerance: contact tolerance, m; see Body.ContactTolerance.
        public static Settings Coupled(double force, double torque, double period, double tolerance)
        {
            Settings settings;
            PalpusException.Check(Native.palpus_settings_coupled(force, torque, period, tolerance, out settings));
            return settings;
        }
    }

    public sealed class PalpusException : Exception
    {
        public readonly int Code;
        PalpusException(int code, string text) : base(text) { Code = code; }

        public static void Check(int code)
        {
            if (code == 0) return;
            IntPtr text = Native.palpus_last_error();
            int length = 0;
            while (Marshal.ReadByte(text, length) != 0) length++;
            var bytes = new byte[length];
            Marshal.Copy(text, bytes, 0, length);
            throw new PalpusException(code, Encoding.UTF8.GetString(bytes));
        }
    }

    public sealed class Body : IDisposable
    {
        internal BodyHandle Handle;

        /// vertices: x, y, z of each vertex, m. triangles: three vertex numbers of each triangle.
        public Body(double[] vertices, uint[] triangles)
        {
            PalpusException.Check(Native.palpus_body_from_triangles(vertices, (UIntPtr)(vertices.Length / 3), triangles,
                (UIntPtr)(triangles.Length / 3), IntPtr.Zero, out Handle));
        }

        /// Returns a contact tolerance (m) that suits this body and b. poseBa: pose of this body in b's
        /// frame. Parts with play must fit into each other there.
        public double ContactTolerance(Body b, Pose poseBa)
        {
            double tolerance;
            PalpusException.Check(Native.palpus_contact_tolerance(Handle, b.Handle, ref poseBa, out tolerance));
            return tolerance;
        }

        /// Reads a mesh file. scale: m per unit of the model.
        public Body(string path, double scale)
        {
            var settings = new BodySettings { Scale = scale, Flatness = 3e-5, Thick = 1 };
            PalpusException.Check(Native.palpus_body_from_file(Encoding.UTF8.GetBytes(path + "\0"), ref settings, out Handle));
        }

        public void Dispose() { Native.palpus_body_destroy(Handle); Handle.Id = 0; }
    }

    public sealed class World : IDisposable
    {
        WorldHandle handle;

        public World(Settings settings)
        {
            PalpusException.Check(Native.palpus_check_abi(3));
            PalpusException.Check(Native.palpus_world_create(ref settings, out handle));
        }

        public void SetGravity(Vector gravity) { PalpusException.Check(Native.palpus_world_set_gravity(handle, ref gravity)); }

        public ObjectHandle AddFixed(Body body, Pose pose)
        {
            ObjectHandle added;
            PalpusException.Check(Native.palpus_world_add_fixed(handle, body.Handle, ref pose, out added));
            return added;
        }

        /// mass: kg.
        public ObjectHandle AddFree(Body body, Pose pose, double mass)
        {
            ObjectHandle added;
            PalpusException.Check(Native.palpus_world_add_free(handle, body.Handle, ref pose, mass, out added));
            return added;
        }

        public ToolHandle AddTool(Body body, Settings settings)
        {
            ToolHandle added;
            PalpusException.Check(Native.palpus_world_add_tool(handle, body.Handle, ref settings, out added));
            return added;
        }

        /// Computes one tick. dt: time since the last tick, s. Both arrays have one element per
        /// tool.
        public void Step(Probe[] probes, Wrench[] wrenches, double dt)
        {
            if (probes.Length != wrenches.Length) throw new ArgumentException("there must be as many wrenches as probes");
            PalpusException.Check(Native.palpus_world_step(handle, probes, wrenches, (UIntPtr)probes.Length, dt));
        }

        public Pose PoseOf(ObjectHandle what)
        {
            Pose pose;
            PalpusException.Check(Native.palpus_world_get_pose(handle, what, out pose));
            return pose;
        }

        public void Dispose() { Native.palpus_world_destroy(handle); handle.Id = 0; }
    }

    static class Native
    {
        const string Library = "palpus_capi";
        const CallingConvention C = CallingConvention.Cdecl;

        [DllImport(Library, CallingConvention = C)] internal static extern int palpus_check_abi(uint version);
        [DllImport(Library, CallingConvention = C)] internal static extern IntPtr palpus_last_error();
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_settings_coupled(double force, double torque, double period, double tolerance, out Settings settings);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_contact_tolerance(BodyHandle a, BodyHandle b, ref Pose poseBa, out double tolerance);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_body_from_triangles(double[] vertices, UIntPtr vertexCount, uint[] triangles, UIntPtr triangleCount, IntPtr settings, out BodyHandle body);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_body_from_file(byte[] path, ref BodySettings settings, out BodyHandle body);
        [DllImport(Library, CallingConvention = C)] internal static extern int palpus_body_destroy(BodyHandle body);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_world_create(ref Settings settings, out WorldHandle world);
        [DllImport(Library, CallingConvention = C)] internal static extern int palpus_world_destroy(WorldHandle world);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_world_set_gravity(WorldHandle world, ref Vector gravity);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_world_add_fixed(WorldHandle world, BodyHandle body, ref Pose pose, out ObjectHandle added);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_world_add_free(WorldHandle world, BodyHandle body, ref Pose pose, double mass, out ObjectHandle added);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_world_add_tool(WorldHandle world, BodyHandle body, ref Settings settings, out ToolHandle tool);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_world_step(WorldHandle world, [In] Probe[] probes, [Out] Wrench[] wrenches, UIntPtr count, double dt);
        [DllImport(Library, CallingConvention = C)]
        internal static extern int palpus_world_get_pose(WorldHandle world, ObjectHandle what, out Pose pose);
    }
}

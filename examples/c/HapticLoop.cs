// A haptic loop in C#, like haptic_loop.c.
using System;
using System.Globalization;

static class HapticLoop
{
    static Palpus.Body Block(double x, double y, double z)
    {
        var vertices = new double[24];
        for (int k = 0; k < 8; k++)
        {
            vertices[3 * k] = (k & 1) != 0 ? x / 2 : -x / 2;
            vertices[3 * k + 1] = (k & 2) != 0 ? y / 2 : -y / 2;
            vertices[3 * k + 2] = (k & 4) != 0 ? z / 2 : -z / 2;
        }
        var triangles = new uint[] {
            0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6 };
        return new Palpus.Body(vertices, triangles);
    }

    static int Main()
    {
        var probes = new Palpus.Probe[1];
        var wrenches = new Palpus.Wrench[1];
        using (var plate = Block(0.1, 0.1, 0.02))
        using (var finger = Block(0.01, 0.01, 0.04))
        {
            // The finger is on the plate at this pose.
            double tolerance = finger.ContactTolerance(plate, Palpus.Pose.At(0, 0, 0.03));
            var settings = Palpus.Settings.Coupled(8.5, 0.19, 1e-3, tolerance);
            using (var world = new Palpus.World(settings))
            {
                world.AddFixed(plate, Palpus.Pose.At(0, 0, 0));
                world.AddTool(finger, settings);
                for (int tick = 0; tick < 1000; tick++)
                {
                    // Read the state of your device here. The tool touches the plate at 0.03 m.
                    probes[0].Pose = Palpus.Pose.At(0, 0, 0.04 - 0.000012 * tick);
                    world.Step(probes, wrenches, 1e-3);
                    // Send the wrench to your device here.
                    if (tick % 100 == 99)
                        Console.WriteLine(string.Format(CultureInfo.InvariantCulture, "{0,3} ms: {1:F6} N", tick + 1, wrenches[0].Force.Z));
                }
            }
        }
        try { new Palpus.Body("not-there.obj", 1); }
        catch (Palpus.PalpusException error) { Console.WriteLine("expected error: " + error.Message); return wrenches[0].Force.Z > 1 ? 0 : 1; }
        return 1;
    }
}

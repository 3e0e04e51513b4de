<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="categorizedSymbol" attr="demand" forceraster="0" enableorderby="0" symbollevels="0">
    <categories>
      <category symbol="0" value="met" type="string" label="Leaks of the demanded size would be found" render="true"/>
      <category symbol="1" value="not met" type="string" label="They may be missed" render="true"/>
      <category symbol="2" value="unknown" type="string" label="Unknown" render="true"/>
    </categories>
    <symbols>
      <symbol name="0" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="49,104,160,110"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="49,104,160,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.1"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="239,110,60,110"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="239,110,60,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.1"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="110,110,110,110"/>
            <Option type="QString" name="style" value="b_diagonal"/>
            <Option type="QString" name="outline_color" value="110,110,110,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.1"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <fieldConfiguration>
    <field name="id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="km" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="lining_area" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="demand" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="probability" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="demand_area" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="demand_drop" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="smallest_1_5_db" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="smallest_3_db" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="smallest_6_db" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="trials" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" field="id" name="Block key"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="km" name="Kilometre"/>
    <alias index="4" field="chainage_from" name="Chainage from (m)"/>
    <alias index="5" field="chainage_to" name="Chainage to (m)"/>
    <alias index="6" field="label" name="Station"/>
    <alias index="7" field="arc_from" name="Smallest arc (m)"/>
    <alias index="8" field="arc_to" name="Greatest arc (m)"/>
    <alias index="9" field="lining_area" name="Inspected lining (m²)"/>
    <alias index="10" field="demand" name="Demand"/>
    <alias index="11" field="probability" name="Probability that a demanded leak is found"/>
    <alias index="12" field="demand_area" name="Demanded area (m²)"/>
    <alias index="13" field="demand_drop" name="Demanded darkening (dB)"/>
    <alias index="14" field="smallest_1_5_db" name="Smallest leak found at 1.5 dB (m²)"/>
    <alias index="15" field="smallest_3_db" name="Smallest leak found at 3 dB (m²)"/>
    <alias index="16" field="smallest_6_db" name="Smallest leak found at 6 dB (m²)"/>
    <alias index="17" field="trials" name="Synthetic leaks in the kilometre"/>
  </aliases>
  <previewExpression>"label"</previewExpression>
  <mapTip>&lt;b&gt;[% replace("label", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;/b&gt;: [% if("probability" IS NULL, 'unknown which leaks would be found', 'leaks of ' || format_number("demand_area", 2) || ' m² and ' || format_number("demand_drop", 1) || ' dB are found with ' || round(100 * "probability") || ' %') %]&lt;br&gt;Smallest found at 3 dB: [% coalesce(format_number("smallest_3_db", 2) || ' m²', if("probability" IS NULL, 'unknown', 'none up to 3 m²')) %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
